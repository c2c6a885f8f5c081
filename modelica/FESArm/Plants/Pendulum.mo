within FESArm.Plants;
model Pendulum "Rigid pendulum in a vertical plane"
  import SI = FESArm.Units;
  import FESArm.Effects.JointTorque;
  import FESArm.Effects.JointSensor;
  parameter SI.Length a = 0.147755 "Distance of the centre of mass from the pivot";
  parameter SI.Mass m = 0.147585 "Mass";
  parameter SI.Inertia I = 1.0912e-4 "Inertia about the centre of mass";
  parameter SI.Acceleration g = 9.81001 "Gravity";
  input SI.Torque correction_theta(start=0) "Torque at the pivot beside the model's own";
  output SI.Angle theta "Reading of the angle from upright: pi when hanging at rest";
  SI.Angle q(start=3.0, fixed=true) "Angle from upright";
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
  theta = jointSensor2.y[1];
  der(q) = w;
  der(w) = wdot;
  (I + m*a^2)*wdot = m*g*a*sin(q) + jointTorque1.tau[1] + jointTorque2.tau[1] + jointTorque3.tau[1] + correction_theta;
  annotation (Documentation(info="<html>
<p>(I + m a^2) der(w) = m g a sin(q) + torques at the pivot. A rigid body in a bearing without friction; friction is an
effect in a slot. Data: single pendulum of Kaheman et al. 2022 (arXiv 2205.06231), whose viscous friction of
2.2394e-4 N.m.s/rad is left out.</p>
</html>"));
end Pendulum;
