within FESArm.Effects.Field;
model NoField "Absent effect: the plane is level"
  extends PartialField(present=false);
equation
  g = zeros(2);
  annotation (Documentation(info="<html><p>g = 0: no mass has a weight in a level plane.</p></html>"));
end NoField;
