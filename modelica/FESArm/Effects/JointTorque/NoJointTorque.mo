within FESArm.Effects.JointTorque;
model NoJointTorque "Absent effect"
  extends PartialJointTorque(present=false);
equation
  tau = zeros(n);
  annotation (Documentation(info="<html><p>tau = 0: nothing is added at the joints.</p></html>"));
end NoJointTorque;
