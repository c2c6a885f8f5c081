within FESArm.Plants;
model Cart "Cart on a rail with a pole hinged to it"
  import SI = FESArm.Units;
  import FESArm.Effects.JointTorque;
  parameter SI.Mass M = 0.5 "Mass of the cart";
  parameter SI.Mass m = 0.147585 "Mass of the pole";
  parameter SI.Length l = 0.147755 "Distance of the pole's centre of mass from the hinge";
  parameter SI.Inertia I = 1.0912e-4 "Inertia of the pole about its centre of mass";
  parameter SI.Acceleration g = 9.81 "Gravity";
  input SI.Force force(start=0) "Force on the cart, along x";
  input SI.Force correction_x(start=0) "Force on the cart beside the model's own";
  input SI.Torque correction_theta(start=0) "Torque at the hinge beside the model's own";
  output SI.Length x(start=0, fixed=true) "Position of the cart";
  output SI.Angle theta(start=2.5, fixed=true) "Angle of the pole from upright, leaning towards x: pi when hanging";
  SI.Velocity v(start=0, fixed=true) "= der(x)";
  SI.AngularVelocity w(start=0, fixed=true) "= der(theta)";
  replaceable model JointTorque1 = JointTorque.NoJointTorque constrainedby JointTorque.PartialJointTorque;
  JointTorque1 jointTorque1(n=1);
  replaceable model JointTorque2 = JointTorque.NoJointTorque constrainedby JointTorque.PartialJointTorque;
  JointTorque2 jointTorque2(n=1);
  replaceable model JointTorque3 = JointTorque.NoJointTorque constrainedby JointTorque.PartialJointTorque;
  JointTorque3 jointTorque3(n=1);
protected
  SI.Acceleration vdot "= der(v)";
  SI.AngularAcceleration wdot "= der(w)";
  SI.Inertia J "Inertia of the pole about the hinge";
  SI.FirstMoment s "Coupling of cart and pole";
  SI.Force fx "Force on both bodies along x";
  SI.Torque tau "Torque on the pole about the hinge";
equation
  jointTorque1.q = {theta};
  jointTorque1.w = {w};
  jointTorque1.a = {wdot};
  jointTorque2.q = {theta};
  jointTorque2.w = {w};
  jointTorque2.a = {wdot};
  jointTorque3.q = {theta};
  jointTorque3.w = {w};
  jointTorque3.a = {wdot};
  J = I + m*l^2;
  s = m*l*cos(theta);
  fx = force + m*l*sin(theta)*w^2 + correction_x;
  tau = m*g*l*sin(theta) + jointTorque1.tau[1] + jointTorque2.tau[1] + jointTorque3.tau[1] + correction_theta;
  der(x) = v;
  der(theta) = w;
  der(v) = vdot;
  der(w) = wdot;
  vdot = (J*fx - s*tau)/((M + m)*J - s^2);
  wdot = ((M + m)*tau - s*fx)/((M + m)*J - s^2);
  annotation (Documentation(info="<html>
<p>(M + m) der(v) + m l cos(theta) der(w) - m l sin(theta) w^2 = force and
m l cos(theta) der(v) + (I + m l^2) der(w) - m g l sin(theta) = torque at the hinge, solved for the accelerations. A frictionless
rail of any length and a frictionless hinge. The pole is that of <code>Pendulum</code>; the cart's mass was chosen for this
project.</p>
</html>"));
end Cart;
