within FESArm.Effects.JointTorque;
model NoJointTorque "Absent effect"
  extends PartialJointTorque(present=false);
equation
  tau = zeros(n);
end NoJointTorque;
