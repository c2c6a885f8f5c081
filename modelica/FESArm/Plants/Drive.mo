within FESArm.Plants;
model Drive "Inertia driven by a torque"
  import SI = FESArm.Units;
  import FESArm.Effects.JointTorque;
  import FESArm.Effects.Transmission;
  parameter SI.Inertia J = 0.02 "Inertia of rotor and load";
  input SI.Torque torque(start=0) "Torque of the motor";
  input SI.Torque correction_phi(start=0) "Torque beside the model's own";
  output SI.Angle phi(start=0, fixed=true) "Angle of the shaft";
  SI.AngularVelocity w(start=0, fixed=true) "= der(phi)";
  replaceable model JointTorque1 = JointTorque.NoJointTorque constrainedby JointTorque.PartialJointTorque;
  JointTorque1 jointTorque1(n=1);
  replaceable model JointTorque2 = JointTorque.NoJointTorque constrainedby JointTorque.PartialJointTorque;
  JointTorque2 jointTorque2(n=1);
  replaceable model JointTorque3 = JointTorque.NoJointTorque constrainedby JointTorque.PartialJointTorque;
  JointTorque3 jointTorque3(n=1);
  replaceable model Transmission1 = Transmission.RigidTransmission constrainedby Transmission.PartialTransmission;
  Transmission1 transmission1;
protected
  SI.AngularAcceleration wdot "= der(w)";
equation
  jointTorque1.q = {phi};
  jointTorque1.w = {w};
  jointTorque1.a = {wdot};
  jointTorque2.q = {phi};
  jointTorque2.w = {w};
  jointTorque2.a = {wdot};
  jointTorque3.q = {phi};
  jointTorque3.w = {w};
  jointTorque3.a = {wdot};
  der(phi) = w;
  der(w) = wdot;
  transmission1.J = J;
  transmission1.a = wdot;
  transmission1.JMotor*wdot = torque + transmission1.tau + jointTorque1.tau[1] + jointTorque2.tau[1]
    + jointTorque3.tau[1] + correction_phi;
  annotation (Documentation(info="<html>
<p>J der(w) = torque + torques of the effects: one degree of freedom, the rotational twin of a mass under a force. Friction,
springs, cogging and end stops are effects in the slots. The inertia is that of a small servo axis, chosen for this
project.</p>
</html>"));
end Drive;
