within FESArm.Plants;
model Cart "Cart on a rail with a pole hinged to it"
  import SI = FESArm.Units;
  import FESArm.Effects.JointTorque;
  import FESArm.Effects.JointSensor;
  import FESArm.Effects.Force;
  import FESArm.Effects.LengthSensor;
  import FESArm.Effects.Actuator;
  parameter SI.Mass M = 0.5 "Mass of the cart";
  parameter SI.Mass m = 0.147585 "Mass of the pole";
  parameter SI.Length l = 0.147755 "Distance of the pole's centre of mass from the hinge";
  parameter SI.Inertia I = 1.0912e-4 "Inertia of the pole about its centre of mass";
  parameter SI.Acceleration g = 9.81 "Gravity";
  constant SI.Force fRef = 1 "Reference of the actuator's command";
  input SI.Force force(start=0) "Force on the cart, along x";
  input SI.Force correction_x(start=0) "Force on the cart beside the model's own";
  input SI.Torque correction_theta(start=0) "Torque at the hinge beside the model's own";
  output SI.Length x "Reading of the position of the cart";
  output SI.Angle theta "Reading of the angle of the pole from upright, leaning towards x: pi when hanging";
  SI.Length s(start=0, fixed=true) "Position of the cart";
  SI.Angle q(start=2.5, fixed=true) "Angle of the pole";
  SI.Velocity v(start=0, fixed=true) "= der(s)";
  SI.AngularVelocity w(start=0, fixed=true) "= der(q)";
  replaceable model JointTorque1 = JointTorque.NoJointTorque constrainedby JointTorque.PartialJointTorque;
  JointTorque1 jointTorque1(n=1);
  replaceable model JointTorque2 = JointTorque.NoJointTorque constrainedby JointTorque.PartialJointTorque;
  JointTorque2 jointTorque2(n=1);
  replaceable model JointTorque3 = JointTorque.NoJointTorque constrainedby JointTorque.PartialJointTorque;
  JointTorque3 jointTorque3(n=1);
  replaceable model Force1 = Force.NoForce constrainedby Force.PartialForce;
  Force1 force1(n=1);
  replaceable model Force2 = Force.NoForce constrainedby Force.PartialForce;
  Force2 force2(n=1);
  replaceable model Force3 = Force.NoForce constrainedby Force.PartialForce;
  Force3 force3(n=1);
  replaceable model JointSensor1 = JointSensor.TrueJointSensor constrainedby JointSensor.PartialJointSensor;
  JointSensor1 jointSensor1(n=1);
  replaceable model JointSensor2 = JointSensor.TrueJointSensor constrainedby JointSensor.PartialJointSensor;
  JointSensor2 jointSensor2(n=1);
  replaceable model LengthSensor1 = LengthSensor.TrueLengthSensor constrainedby LengthSensor.PartialLengthSensor;
  LengthSensor1 lengthSensor1(n=1);
  replaceable model LengthSensor2 = LengthSensor.TrueLengthSensor constrainedby LengthSensor.PartialLengthSensor;
  LengthSensor2 lengthSensor2(n=1);
  replaceable model Actuator1 = Actuator.IdealActuator constrainedby Actuator.PartialActuator;
  Actuator1 actuator1;
  replaceable model Actuator2 = Actuator.IdealActuator constrainedby Actuator.PartialActuator;
  Actuator2 actuator2;
protected
  SI.Acceleration vdot "= der(v)";
  SI.AngularAcceleration wdot "= der(w)";
  SI.Inertia J "Inertia of the pole about the hinge";
  SI.FirstMoment c "Coupling of cart and pole";
  SI.Force fx "Force on both bodies along x";
  SI.Torque tau "Torque on the pole about the hinge";
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
  force1.x = {s};
  force1.v = {v};
  force1.a = {vdot};
  force2.x = {s};
  force2.v = {v};
  force2.a = {vdot};
  force3.x = {s};
  force3.v = {v};
  force3.a = {vdot};
  jointSensor1.q = {q};
  jointSensor2.q = jointSensor1.y;
  lengthSensor1.x = {s};
  lengthSensor2.x = lengthSensor1.y;
  x = lengthSensor2.y[1];
  theta = jointSensor2.y[1];
  actuator1.u = force/fRef;
  actuator2.u = actuator1.y;
  J = I + m*l^2;
  c = m*l*cos(q);
  fx = fRef*actuator2.y + m*l*sin(q)*w^2 + force1.f[1] + force2.f[1] + force3.f[1] + correction_x;
  tau = m*g*l*sin(q) + jointTorque1.tau[1] + jointTorque2.tau[1] + jointTorque3.tau[1] + correction_theta;
  der(s) = v;
  der(q) = w;
  der(v) = vdot;
  der(w) = wdot;
  vdot = (J*fx - c*tau)/((M + m)*J - c^2);
  wdot = ((M + m)*tau - c*fx)/((M + m)*J - c^2);
  annotation (Documentation(info="<html>
<p>(M + m) der(v) + m l cos(q) der(w) - m l sin(q) w^2 = force and
m l cos(q) der(v) + (I + m l^2) der(w) - m g l sin(q) = torque at the hinge, solved for the accelerations. A frictionless
rail of any length and a frictionless hinge; slots hold forces along the rail, torques at the hinge, and errors of drive and
sensors. The pole is that of <code>Pendulum</code>; the cart's mass was chosen for this
project.</p>
</html>"));
end Cart;
