within FESArm.Effects.Force;
model LinearCoulombFriction "Friction of a slide of constant size against the motion"
  import SI = FESArm.Units;
  extends PartialForce;
  parameter SI.Force fC[n](each min=0) = fill(0.1, n) "Size of the friction force";
  parameter SI.Velocity vSharp(min=1e-5) = 0.001 "Speed at which 76 % of the full force is reached";
equation
  for i in 1:n loop
    f[i] = -fC[i]*tanh(v[i]/vSharp);
  end for;
  annotation (Documentation(info="<html>
<p>f = -fC tanh(v/vSharp), smooth by construction, the sliding twin of <code>JointTorque.CoulombFriction</code>.
Limit: a loaded body at rest creeps, at most at the speed vSharp artanh(load/fC), instead of sticking.</p>
<p>Independent of load and speed. Source of the law: Armstrong-Helouvry, Dupont, Canudas de Wit, A survey of models,
analysis tools and compensation methods for the control of machines with friction, Automatica 30 (1994); the smoothing
is chosen here.</p>
</html>"));
end LinearCoulombFriction;
