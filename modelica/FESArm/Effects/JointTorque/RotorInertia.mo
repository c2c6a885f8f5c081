within FESArm.Effects.JointTorque;
model RotorInertia "Inertia reflected to the joints"
  import SI = FESArm.Units;
  extends PartialJointTorque;
  parameter SI.Inertia J[n] = fill(0.01, n) "Inertia about the joint axis";
equation
  for i in 1:n loop
    tau[i] = -J[i]*a[i];
  end for;
  annotation (Documentation(info="<html>
<p>tau = -J der(w).</p>
<p>A rotor with the inertia Jr behind a stiff gear of ratio N has J = N^2 Jr; it turns about an axis fixed to the
ground, so there is no coupling between the joints. Source: Spong, Hutchinson, Vidyasagar, Robot Modeling and Control
(2006), chapter 6. Negative values mean that the nominal inertia is too large.</p>
</html>"));
end RotorInertia;
