within FESArm.Effects.JointTorque;
model PassiveStiffness "Springs at the joints about some posture"
  import SI = FESArm.Units;
  extends PartialJointTorque;
  parameter SI.RotationalStiffness k[n](each min=0) = fill(0.1, n) "Stiffness";
  parameter SI.Torque tau0[n] = fill(0, n) "Torque at q = 0; the rest posture is tau0/k";
equation
  for i in 1:n loop
    tau[i] = tau0[i] - k[i]*q[i];
  end for;
  annotation (Documentation(info="<html>
<p>tau = tau0 - k q, which is -k (q - qRef) with the rest posture qRef = tau0/k. Written so that both parameters enter
linearly.</p>
<p>Linear about one posture, no coupling between the joints, no loss. Source: Hooke's law; passive joint torques of
people are linear only within the middle of the range (Riener and Edrich, Identification of passive elastic joint
moments in the lower extremities, Journal of Biomechanics 32 (1999)).</p>
</html>"));
end PassiveStiffness;
