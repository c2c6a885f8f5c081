within FESArm.Test;
model ViscousDecay "Speed of an inertia under viscous friction alone decays exponentially"
  import SI = FESArm.Units;
  parameter SI.Inertia J = 0.1 "Inertia";
  parameter SI.AngularVelocity w0 = 2 "Speed at the start";
  FESArm.Effects.JointTorque.ViscousFriction friction(n=1, b={0.25});
  SI.Angle q(start=0, fixed=true) "Angle";
  SI.AngularVelocity w(start=w0, fixed=true) "Speed";
  output SI.AngularVelocity wError "Zero when the law is right";
equation
  der(q) = w;
  friction.q = {q};
  friction.w = {w};
  friction.a = {der(w)};
  J*der(w) = friction.tau[1];
  wError = w - w0*exp(-friction.b[1]*time/J);
  annotation (experiment(StopTime=2), Documentation(info="<html>
<p>J der(w) = -b w, w(0) = w0 has w = w0 exp(-b t/J).</p>
</html>"));
end ViscousDecay;
