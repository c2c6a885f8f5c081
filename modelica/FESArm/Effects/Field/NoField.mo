within FESArm.Effects.Field;
model NoField "Absent effect: the plane is level"
  extends PartialField(present=false);
equation
  g = zeros(2);
end NoField;
