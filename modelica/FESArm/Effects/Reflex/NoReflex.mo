within FESArm.Effects.Reflex;
model NoReflex "Absent effect"
  extends PartialReflex(present=false);
equation
  added = zeros(n);
end NoReflex;
