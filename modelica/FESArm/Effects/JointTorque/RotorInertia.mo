within FESArm.Effects.JointTorque;
model RotorInertia "Inertia reflected to the joints"
  import SI = FESArm.Units;
  extends PartialJointTorque;
  parameter SI.Inertia J[n](each max=5) = fill(0.01, n) "Inertia about the joint axis";
equation
  for i in 1:n loop
    tau[i] = -J[i]*a[i];
  end for;
  annotation (Documentation(info="<html><p>tau = -J der(w).</p></html>"));
end RotorInertia;
