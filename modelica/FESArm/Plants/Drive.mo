within FESArm.Plants;
model Drive "Inertia driven by a torque"
  import SI = FESArm.Units;
  import FESArm.Effects.JointTorque;
  import FESArm.Effects.JointSensor;
  import FESArm.Effects.Actuator;
  import FESArm.Effects.Transmission;
  parameter SI.Inertia J = 0.02 "Inertia of rotor and load";
  constant SI.Torque tauRef = 1 "Reference of the actuator's command";
  input SI.Torque torque(start=0) "Torque of the motor";
  input SI.Torque correction_phi(start=0) "Torque beside the model's own";
  output SI.Angle phi "Reading of the angle of the shaft";
  SI.Angle q(start=0, fixed=true) "Angle of the shaft";
  SI.AngularVelocity w(start=0, fixed=true) "= der(q)";
  replaceable model JointTorque1 = JointTorque.NoJointTorque constrainedby JointTorque.PartialJointTorque;
  JointTorque1 jointTorque1(n=1);
  replaceable model JointTorque2 = JointTorque.NoJointTorque constrainedby JointTorque.PartialJointTorque;
  JointTorque2 jointTorque2(n=1);
  replaceable model JointTorque3 = JointTorque.NoJointTorque constrainedby JointTorque.PartialJointTorque;
  JointTorque3 jointTorque3(n=1);
  replaceable model JointSensor1 = JointSensor.TrueJointSensor constrainedby JointSensor.PartialJointSensor;
  JointSensor1 jointSensor1(n=1);
  replaceable model JointSensor2 = JointSensor.TrueJointSensor constrainedby JointSensor.PartialJointSensor;
  JointSensor2 jointSensor2(n=1);
  replaceable model Actuator1 = Actuator.IdealActuator constrainedby Actuator.PartialActuator;
  Actuator1 actuator1;
  replaceable model Actuator2 = Actuator.IdealActuator constrainedby Actuator.PartialActuator;
  Actuator2 actuator2;
  replaceable model Transmission1 = Transmission.RigidTransmission constrainedby Transmission.PartialTransmission;
  Transmission1 transmission1;
protected
  SI.AngularAcceleration wdot "= der(w)";
equation
  jointTorque1.q = {q};
  jointTorque1.w = {w};
  jointTorque1.a = {wdot};
  jointTorque2.q = {q};
  jointTorque2.w = {w};
  jointTorque2.a = {wdot};
  jointTorque3.q = {q};
  jointTorque3.w = {w};
  jointTorque3.a = {wdot};
  jointSensor1.q = {q};
  jointSensor2.q = jointSensor1.y;
  phi = jointSensor2.y[1];
  actuator1.u = torque/tauRef;
  actuator2.u = actuator1.y;
  der(q) = w;
  der(w) = wdot;
  transmission1.J = J;
  transmission1.a = wdot;
  transmission1.JMotor*wdot = tauRef*actuator2.y + transmission1.tau + jointTorque1.tau[1] + jointTorque2.tau[1]
    + jointTorque3.tau[1] + correction_phi;
  annotation (Documentation(info="<html>
<p>J der(w) = torque + torques of the effects: one degree of freedom, the rotational twin of a mass under a force. Friction,
springs, cogging and end stops are effects in the slots, as are errors of the motor and of the encoder. The twin with a mass
is <code>LinearDrive</code>. The inertia is that of a small servo axis, chosen for this
project.</p>
</html>"));
end Drive;
