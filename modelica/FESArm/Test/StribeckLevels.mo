within FESArm.Test;
model StribeckLevels "Friction at speed, at the speed of the breakaway part, and the other way round"
  FESArm.Effects.JointTorque.StribeckFriction friction(n=3, tauC={0.2, 0.2, 0.2}, tauExtra={0.3, 0.3, 0.3}, vS=0.5);
  output Real tauError(unit="N.m") "Zero when the law is right";
equation
  friction.q = {0, 0, 0};
  friction.w = {20, 0.5, -0.5};
  friction.a = {0, 0, 0};
  tauError = abs(friction.tau[1] + 0.2) + abs(friction.tau[2] + 0.2 + 0.3/exp(1)) + abs(friction.tau[3] - 0.2 - 0.3/exp(1));
  annotation (experiment(StopTime=1), Documentation(info="<html>
<p>At 40 vS only tauC is left; at vS the extra part has fallen to 1/e; both speeds are far above wSharp.</p></html>"));
end StribeckLevels;
