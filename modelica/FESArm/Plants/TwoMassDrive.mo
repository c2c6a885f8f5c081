within FESArm.Plants;
model TwoMassDrive "Motor and load on a flexible shaft"
  import SI = FESArm.Units;
  import FESArm.Effects.JointTorque;
  import FESArm.Effects.Shaft;
  parameter SI.Inertia JMotor = 0.002 "Inertia of the motor";
  parameter SI.Inertia JLoad = 0.005 "Inertia of the load";
  parameter SI.RotationalStiffness k = 20 "Stiffness of the shaft";
  parameter SI.RotationalDamping d = 0.01 "Damping of the shaft";
  input SI.Torque torque(start=0) "Torque of the motor";
  input SI.Torque correction_phiMotor(start=0) "Torque on the motor beside the model's own";
  input SI.Torque correction_phiLoad(start=0) "Torque on the load beside the model's own";
  output SI.Angle phiMotor(start=0, fixed=true) "Angle of the motor";
  output SI.Angle phiLoad(start=0, fixed=true) "Angle of the load";
  SI.AngularVelocity wMotor(start=0, fixed=true) "= der(phiMotor)";
  SI.AngularVelocity wLoad(start=0, fixed=true) "= der(phiLoad)";
  replaceable model JointTorque1 = JointTorque.NoJointTorque constrainedby JointTorque.PartialJointTorque;
  JointTorque1 jointTorque1(n=2);
  replaceable model JointTorque2 = JointTorque.NoJointTorque constrainedby JointTorque.PartialJointTorque;
  JointTorque2 jointTorque2(n=2);
  replaceable model JointTorque3 = JointTorque.NoJointTorque constrainedby JointTorque.PartialJointTorque;
  JointTorque3 jointTorque3(n=2);
  replaceable model Shaft1 = Shaft.TightShaft constrainedby Shaft.PartialShaft;
  Shaft1 shaft1;
protected
  SI.AngularAcceleration wMotorDot "= der(wMotor)";
  SI.AngularAcceleration wLoadDot "= der(wLoad)";
  SI.Torque shaft "Torque of the shaft on the load";
equation
  jointTorque1.q = {phiMotor, phiLoad};
  jointTorque1.w = {wMotor, wLoad};
  jointTorque1.a = {wMotorDot, wLoadDot};
  jointTorque2.q = {phiMotor, phiLoad};
  jointTorque2.w = {wMotor, wLoad};
  jointTorque2.a = {wMotorDot, wLoadDot};
  jointTorque3.q = {phiMotor, phiLoad};
  jointTorque3.w = {wMotor, wLoad};
  jointTorque3.a = {wMotorDot, wLoadDot};
  shaft1.twist = phiMotor - phiLoad;
  shaft1.rate = wMotor - wLoad;
  shaft = k*shaft1.stretch + d*shaft1.stretchRate;
  der(phiMotor) = wMotor;
  der(phiLoad) = wLoad;
  der(wMotor) = wMotorDot;
  der(wLoad) = wLoadDot;
  JMotor*wMotorDot = torque - shaft + jointTorque1.tau[1] + jointTorque2.tau[1] + jointTorque3.tau[1]
    + correction_phiMotor;
  JLoad*wLoadDot = shaft + jointTorque1.tau[2] + jointTorque2.tau[2] + jointTorque3.tau[2]
    + correction_phiLoad;
  annotation (Documentation(info="<html>
<p>JMotor der(wMotor) = torque - shaft and JLoad der(wLoad) = shaft with shaft = k (phiMotor - phiLoad) + d (wMotor - wLoad).
A shaft without mass; play is an effect in its slot; the first element of an effect acts on the motor, the second on the load. Data:
a small servo axis with a resonance near 19 Hz, chosen for this project.</p>
</html>"));
end TwoMassDrive;
