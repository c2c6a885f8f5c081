within FESArm.Plants;
model TwoMassDrive "Motor and load on a flexible shaft"
  import SI = FESArm.Units;
  import FESArm.Effects.JointTorque;
  import FESArm.Effects.JointSensor;
  import FESArm.Effects.Actuator;
  import FESArm.Effects.Shaft;
  parameter SI.Inertia JMotor = 0.002 "Inertia of the motor";
  parameter SI.Inertia JLoad = 0.005 "Inertia of the load";
  parameter SI.RotationalStiffness k = 20 "Stiffness of the shaft";
  parameter SI.RotationalDamping d = 0.01 "Damping of the shaft";
  constant SI.Torque tauRef = 1 "Reference of the actuator's command";
  input SI.Torque torque(start=0) "Torque of the motor";
  input SI.Torque correction_phiMotor(start=0) "Torque on the motor beside the model's own";
  input SI.Torque correction_phiLoad(start=0) "Torque on the load beside the model's own";
  output SI.Angle phiMotor "Reading of the angle of the motor";
  output SI.Angle phiLoad "Reading of the angle of the load";
  SI.Angle qMotor(start=0, fixed=true) "Angle of the motor";
  SI.Angle qLoad(start=0, fixed=true) "Angle of the load";
  SI.AngularVelocity wMotor(start=0, fixed=true) "= der(qMotor)";
  SI.AngularVelocity wLoad(start=0, fixed=true) "= der(qLoad)";
  replaceable model JointTorque1 = JointTorque.NoJointTorque constrainedby JointTorque.PartialJointTorque;
  JointTorque1 jointTorque1(n=2);
  replaceable model JointTorque2 = JointTorque.NoJointTorque constrainedby JointTorque.PartialJointTorque;
  JointTorque2 jointTorque2(n=2);
  replaceable model JointTorque3 = JointTorque.NoJointTorque constrainedby JointTorque.PartialJointTorque;
  JointTorque3 jointTorque3(n=2);
  replaceable model Shaft1 = Shaft.TightShaft constrainedby Shaft.PartialShaft;
  Shaft1 shaft1;
  replaceable model JointSensor1 = JointSensor.TrueJointSensor constrainedby JointSensor.PartialJointSensor;
  JointSensor1 jointSensor1(n=2);
  replaceable model JointSensor2 = JointSensor.TrueJointSensor constrainedby JointSensor.PartialJointSensor;
  JointSensor2 jointSensor2(n=2);
  replaceable model Actuator1 = Actuator.IdealActuator constrainedby Actuator.PartialActuator;
  Actuator1 actuator1;
  replaceable model Actuator2 = Actuator.IdealActuator constrainedby Actuator.PartialActuator;
  Actuator2 actuator2;
protected
  SI.AngularAcceleration wMotorDot "= der(wMotor)";
  SI.AngularAcceleration wLoadDot "= der(wLoad)";
  SI.Torque shaft "Torque of the shaft on the load";
equation
  jointTorque1.q = {qMotor, qLoad};
  jointTorque1.w = {wMotor, wLoad};
  jointTorque1.a = {wMotorDot, wLoadDot};
  jointTorque2.q = {qMotor, qLoad};
  jointTorque2.w = {wMotor, wLoad};
  jointTorque2.a = {wMotorDot, wLoadDot};
  jointTorque3.q = {qMotor, qLoad};
  jointTorque3.w = {wMotor, wLoad};
  jointTorque3.a = {wMotorDot, wLoadDot};
  jointSensor1.q = {qMotor, qLoad};
  jointSensor2.q = jointSensor1.y;
  phiMotor = jointSensor2.y[1];
  phiLoad = jointSensor2.y[2];
  actuator1.u = torque/tauRef;
  actuator2.u = actuator1.y;
  shaft1.twist = qMotor - qLoad;
  shaft1.rate = wMotor - wLoad;
  shaft = k*shaft1.stretch + d*shaft1.stretchRate;
  der(qMotor) = wMotor;
  der(qLoad) = wLoad;
  der(wMotor) = wMotorDot;
  der(wLoad) = wLoadDot;
  JMotor*wMotorDot = tauRef*actuator2.y - shaft + jointTorque1.tau[1] + jointTorque2.tau[1] + jointTorque3.tau[1]
    + correction_phiMotor;
  JLoad*wLoadDot = shaft + jointTorque1.tau[2] + jointTorque2.tau[2] + jointTorque3.tau[2]
    + correction_phiLoad;
  annotation (Documentation(info="<html>
<p>JMotor der(wMotor) = torque - shaft and JLoad der(wLoad) = shaft with shaft = k (qMotor - qLoad) + d (wMotor - wLoad).
A shaft without mass; play is an effect in its slot; the first element of an effect acts on the motor, the second on the load. Data:
a small servo axis with a resonance near 19 Hz, chosen for this project.</p>
</html>"));
end TwoMassDrive;
