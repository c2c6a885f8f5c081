within FESArm.Effects.JointTorque;
model EndStopBelow "Soft stop that acts below an angle"
  extends PartialEndStop(side=-1);
end EndStopBelow;
