within FESArm.Effects.Force;
model LinearViscousFriction "Friction of a slide in proportion to its speed"
  import SI = FESArm.Units;
  extends PartialForce;
  parameter SI.Damping b[n](each min=0) = fill(0.1, n) "Damping";
equation
  for i in 1:n loop
    f[i] = -b[i]*v[i];
  end for;
  annotation (Documentation(info="<html>
<p>f = -b v. Dissipates for b &gt; 0. The sliding twin of <code>JointTorque.ViscousFriction</code>.</p>
<p>Linear, as of a film of oil. Source: Armstrong-Helouvry, Dupont, Canudas de Wit, A survey of models, analysis tools
and compensation methods for the control of machines with friction, Automatica 30 (1994).</p>
</html>"));
end LinearViscousFriction;
