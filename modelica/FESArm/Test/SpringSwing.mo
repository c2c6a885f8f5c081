within FESArm.Test;
model SpringSwing "An inertia on the passive stiffness swings like a cosine about tau0/k"
  import SI = FESArm.Units;
  parameter SI.Inertia J = 0.1 "Inertia";
  FESArm.Effects.JointTorque.PassiveStiffness spring(n=1, k={2.5}, tau0={0.5});
  SI.Angle q(start=0.5, fixed=true) "Angle";
  SI.AngularVelocity w(start=0, fixed=true) "Speed";
  output SI.Angle qError "Zero when the law is right";
equation
  der(q) = w;
  spring.q = {q};
  spring.w = {w};
  spring.a = {der(w)};
  J*der(w) = spring.tau[1];
  qError = q - 0.2 - 0.3*cos(5*time);
  annotation (experiment(StopTime=2), Documentation(info="<html>
<p>The rest posture is 0.5/2.5 = 0.2 rad, the angular frequency sqrt(2.5/0.1) = 5 rad/s.</p></html>"));
end SpringSwing;
