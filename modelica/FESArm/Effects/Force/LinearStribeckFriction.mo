within FESArm.Effects.Force;
model LinearStribeckFriction "Coulomb friction of a slide with a breakaway part that fades with speed"
  import SI = FESArm.Units;
  extends PartialForce;
  parameter SI.Force fC[n](each min=0) = fill(0.05, n) "Friction force at speed";
  parameter SI.Force fExtra[n](each min=0) = fill(0.05, n) "Extra force near rest";
  parameter SI.Velocity vS(min=0.002, max=2) = 0.05 "Speed at which the extra part has fallen to 37 %";
  parameter SI.Velocity vSharp(min=1e-5) = 0.001 "Speed at which 76 % of the full force is reached";
equation
  for i in 1:n loop
    f[i] = -(fC[i] + fExtra[i]*exp(-(v[i]/vS)^2))*tanh(v[i]/vSharp);
  end for;
  annotation (Documentation(info="<html>
<p>f = -(fC + fExtra exp(-(v/vS)^2)) tanh(v/vSharp), smooth by construction; see LinearCoulombFriction for its limit
at rest.</p>
<p>The extra part falls like a Gaussian. Source: Armstrong-Helouvry, Dupont, Canudas de Wit, A survey of models,
analysis tools and compensation methods for the control of machines with friction, Automatica 30 (1994), without its
memory and its rising static part.</p>
</html>"));
end LinearStribeckFriction;
