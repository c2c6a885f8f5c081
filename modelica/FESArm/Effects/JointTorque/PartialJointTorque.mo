within FESArm.Effects.JointTorque;
partial model PartialJointTorque "Contract: torque at the joints from their motion"
  import SI = FESArm.Units;
  parameter Boolean present = true "False in the absent effect only";
  parameter Integer n = 2 "Number of joints";
  input SI.Angle q[n] "Joint angles";
  input SI.AngularVelocity w[n] "= der(q)";
  input SI.AngularAcceleration a[n] "= der(w)";
  output SI.Torque tau[n] "Torque on the arm, positive in the direction of q";
  annotation (Documentation(info="<html>
<p>An effect states tau = F(q, w, a, its own states, time); the torques of all slots are added on the right of M(q) a
+ h(q, w) + b w = sum of tau (Lagrange's equations, for example Spong, Hutchinson, Vidyasagar, Robot Modeling and
Control, 2006, chapter 7). The power given to the joints is tau w: an effect that only takes energy has tau w &le; 0.
It may use the acceleration only linearly, or M(q) a is no longer a linear system. Each joint is free of the others
unless an effect says otherwise.</p>
</html>"));
end PartialJointTorque;
