within FESArm.Effects.JointTorque;
model ViscousFriction "Friction in proportion to joint speed, on top of the nominal damping"
  import SI = FESArm.Units;
  extends PartialJointTorque;
  parameter SI.RotationalDamping b[n](each min=0, each max=5) = fill(0.1, n) "Extra damping";
equation
  for i in 1:n loop
    tau[i] = -b[i]*w[i];
  end for;
  annotation (Documentation(info="<html><p>tau = -b w at each joint. Dissipates for b &gt; 0.</p></html>"));
end ViscousFriction;
