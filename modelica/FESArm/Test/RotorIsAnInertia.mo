within FESArm.Test;
model RotorIsAnInertia "A reflected inertia and a steady torque: the angle is a parabola"
  import SI = FESArm.Units;
  parameter SI.Inertia J = 0.1 "Inertia of the joint itself";
  FESArm.Effects.JointTorque.RotorInertia rotor(n=1, J={0.15});
  FESArm.Effects.JointTorque.ConstantTorque steady(n=1, tau0={0.5});
  SI.Angle q(start=0, fixed=true) "Angle";
  SI.AngularVelocity w(start=0, fixed=true) "Speed";
  output SI.Angle qError "Zero when the laws are right";
protected
  SI.AngularAcceleration a "= der(w)";
equation
  der(q) = w;
  der(w) = a;
  rotor.q = {q};
  rotor.w = {w};
  rotor.a = {a};
  steady.q = {q};
  steady.w = {w};
  steady.a = {a};
  J*a = rotor.tau[1] + steady.tau[1];
  qError = q - time^2;
  annotation (experiment(StopTime=2), Documentation(info="<html>
<p>0.5 N.m on 0.1 + 0.15 kg m2 accelerates with 2 rad/s2.</p></html>"));
end RotorIsAnInertia;
