within FESArm.Effects.JointTorque;
model CoulombFriction "Friction of constant size against the motion"
  import SI = FESArm.Units;
  extends PartialJointTorque;
  parameter SI.Torque tauC[n](each min=0) = fill(0.1, n) "Size of the friction torque";
  parameter SI.AngularVelocity wSharp(min=1e-4) = 0.002 "Speed at which 76 % of the full torque is reached";
equation
  for i in 1:n loop
    tau[i] = -tauC[i]*tanh(w[i]/wSharp);
  end for;
  annotation (Documentation(info="<html>
<p>tau = -tauC tanh(w/wSharp), smooth by construction. Limit: a loaded joint at rest creeps, at most at the speed
wSharp artanh(load/tauC), instead of sticking.</p>
<p>Coulomb's law tau = -tauC sign(w), independent of load and speed, with a smoothing chosen here. Source of the law:
Armstrong-Helouvry, Dupont, Canudas de Wit, A survey of models, analysis tools and compensation methods for the
control of machines with friction, Automatica 30 (1994).</p>
</html>"));
end CoulombFriction;
