within FESArm.Effects.JointTorque;
model JointDrag "Torque against the motion, growing with the square of joint speed"
  import SI = FESArm.Units;
  extends PartialJointTorque;
  parameter SI.RotationalDrag c[n](each min=0) = fill(0.02, n) "Drag";
equation
  for i in 1:n loop
    tau[i] = -c[i]*abs(w[i])*w[i];
  end for;
  annotation (Documentation(info="<html>
<p>tau = -c |w| w at each joint. Dissipates for c &gt; 0; its slope is continuous through rest.</p>
<p>A link that turns about its joint in a wide stream at large Reynolds numbers: each element at the distance r moves at
r w, so c is the integral of rho Cd width r^3/2 along the link. The speeds of other joints are left out. Source: drag of a
bluff body, Batchelor, An Introduction to Fluid Dynamics (1967), chapter 5.</p>
</html>"));
end JointDrag;
