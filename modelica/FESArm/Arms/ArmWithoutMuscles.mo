within FESArm.Arms;
model ArmWithoutMuscles "The arm with its muscles elsewhere: forces in, lengths and speeds out"
  import SI = FESArm.Units;
  parameter SI.Length a0[6] = {0.1840, 0.1055, 0.4283, 0.1916, 0.2387, 0.1681} "Lengths at q = 0";
  parameter SI.Length d1[6] = {0.05, -0.05, 0.03, -0.03, 0, 0} "Moment arms about the shoulder, flexors positive";
  parameter SI.Length d2[6] = {0, 0, 0.03, -0.03, -0.03, 0.03} "Moment arms about the elbow, flexors positive";
  input SI.Force F[6](each start=0) "Forces of the muscles, positive when they pull";
  input SI.Force fx(start=0) "External force on the arm at the wrist, world x";
  input SI.Force fy(start=0) "External force on the arm at the wrist, world y";
  output SI.Length L[6] "Lengths of muscles and tendons";
  output SI.Velocity V[6] "= der(L)";
  output SI.Angle q1 "Shoulder angle from the world x axis, flexion positive";
  output SI.Angle q2 "Elbow angle relative to the upper arm, flexion positive";
  FESArm.Linkage.PlanarLinkage linkage;
equation
  for i in 1:6 loop
    L[i] = a0[i] - d1[i]*linkage.q[1] - d2[i]*linkage.q[2];
    V[i] = -d1[i]*linkage.w[1] - d2[i]*linkage.w[2];
  end for;
  linkage.tau[1] = d1[1]*F[1] + d1[2]*F[2] + d1[3]*F[3] + d1[4]*F[4] + d1[5]*F[5] + d1[6]*F[6];
  linkage.tau[2] = d2[1]*F[1] + d2[2]*F[2] + d2[3]*F[3] + d2[4]*F[4] + d2[5]*F[5] + d2[6]*F[6];
  linkage.f = {fx, fy};
  linkage.g = {0, 0};
  q1 = linkage.q[1];
  q2 = linkage.q[2];
  annotation (Documentation(info="<html>
<p>The skeleton of <code>Arm</code> for co-simulation: with six <code>Muscles.MuscleAlone</code> it is the nominal arm,
cut where forces are exchanged for lengths and speeds. L = a0 - d1 q1 - d2 q2, V = der(L), joint torque d F (virtual work,
F dL = -tau dq). Lengths and speeds follow from the state alone, so that the cut closes no algebraic loop.</p>
<p>Assumptions and source: those of <code>PartialArm</code> and <code>PlanarLinkage</code>; moment arms are constant,
tendons run without friction, the plane is level. No slots for effects.</p>
</html>"));
end ArmWithoutMuscles;
