within FESArm.Effects.JointTorque;
model ViscousFriction "Friction in proportion to joint speed, on top of the nominal damping"
  import SI = FESArm.Units;
  extends PartialJointTorque;
  parameter SI.RotationalDamping b[n](each min=0) = fill(0.1, n) "Extra damping";
equation
  for i in 1:n loop
    tau[i] = -b[i]*w[i];
  end for;
  annotation (Documentation(info="<html>
<p>tau = -b w at each joint. Dissipates for b &gt; 0.</p>
<p>Linear and without coupling between the joints, as of a film of oil. Source: Armstrong-Helouvry, Dupont, Canudas de
Wit, A survey of models, analysis tools and compensation methods for the control of machines with friction, Automatica
30 (1994).</p>
</html>"));
end ViscousFriction;
