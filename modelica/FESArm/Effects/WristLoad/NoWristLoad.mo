within FESArm.Effects.WristLoad;
model NoWristLoad "Absent effect"
  extends PartialWristLoad(present=false);
equation
  f = zeros(2);
  annotation (Documentation(info="<html><p>f = 0: the hand is free.</p></html>"));
end NoWristLoad;
