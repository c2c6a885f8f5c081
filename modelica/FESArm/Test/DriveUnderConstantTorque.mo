within FESArm.Test;
model DriveUnderConstantTorque "The angle of an inertia under a constant torque is a parabola, with friction a creeping line"
  FESArm.Plants.Drive drive;
  FESArm.Plants.Drive braked(
    redeclare model JointTorque1 = FESArm.Effects.JointTorque.ViscousFriction,
    jointTorque1(b={0.1}));
  output Real phiError(unit="rad") "Zero when the law is right";
  output Real brakedError(unit="rad/s") "Zero when the law is right";
equation
  drive.torque = 0.03;
  drive.correction_phi = 0;
  braked.torque = 0.03;
  braked.correction_phi = 0;
  phiError = drive.phi - 0.03/drive.J*time^2/2;
  brakedError = braked.w - 0.03/0.1*(1 - exp(-0.1/braked.J*time));
  annotation (experiment(StopTime=2), Documentation(info="<html>
<p>J der(w) = T from rest has phi = T t^2/(2 J). With friction, J der(w) = T - b w has w = T/b (1 - exp(-b t/J)),
which tends to T/b.</p>
</html>"));
end DriveUnderConstantTorque;
