within FESArm.Effects.WristLoad;
model NoWristLoad "Absent effect"
  extends PartialWristLoad(present=false);
equation
  f = zeros(2);
end NoWristLoad;
