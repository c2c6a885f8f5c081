within FESArm.Test;
model CoulombStop "Speed of an inertia under Coulomb friction alone falls linearly, then stops"
  import SI = FESArm.Units;
  parameter SI.Inertia J = 0.1 "Inertia";
  parameter SI.AngularVelocity w0 = 0.2 "Speed at the start";
  FESArm.Effects.JointTorque.CoulombFriction friction(n=1, tauC={0.05}, wSharp=0.01);
  SI.Angle q(start=0, fixed=true) "Angle";
  SI.AngularVelocity w(start=w0, fixed=true) "Speed";
  output SI.AngularVelocity wError "Zero when the law is right";
protected
  SI.Factor z "sinh(w/wSharp)";
equation
  der(q) = w;
  friction.q = {q};
  friction.w = {w};
  friction.a = {der(w)};
  J*der(w) = friction.tau[1];
  z = sinh(w0/friction.wSharp)*exp(-friction.tauC[1]*time/(J*friction.wSharp));
  wError = w - friction.wSharp*log(z + sqrt(z^2 + 1));
  annotation (experiment(StopTime=1), Documentation(info="<html>
<p>J der(w) = -tauC tanh(w/wSharp) has the solution sinh(w/wSharp) = sinh(w0/wSharp) exp(-tauC t/(J wSharp)).</p></html>"));
end CoulombStop;
