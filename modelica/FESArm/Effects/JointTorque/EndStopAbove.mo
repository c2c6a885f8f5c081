within FESArm.Effects.JointTorque;
model EndStopAbove "Soft stop that acts above an angle"
  extends PartialEndStop(side=1);
end EndStopAbove;
