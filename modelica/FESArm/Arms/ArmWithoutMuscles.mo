within FESArm.Arms;
model ArmWithoutMuscles "The arm with its muscles elsewhere: forces in, lengths and speeds out"
  import SI = FESArm.Units;
  parameter SI.Length a0[6] = {0.1840, 0.1055, 0.4283, 0.1916, 0.2387, 0.1681} "Lengths at q = 0";
  parameter SI.Length d1[6] = {0.05, -0.05, 0.03, -0.03, 0, 0} "Moment arms about the shoulder, flexors positive";
  parameter SI.Length d2[6] = {0, 0, 0.03, -0.03, -0.03, 0.03} "Moment arms about the elbow, flexors positive";
  input SI.Force F_1(start=0) "Force, positive when it pulls, anterior deltoid";
  input SI.Force F_2(start=0) "Force, positive when it pulls, posterior deltoid";
  input SI.Force F_3(start=0) "Force, positive when it pulls, biceps";
  input SI.Force F_4(start=0) "Force, positive when it pulls, triceps long head";
  input SI.Force F_5(start=0) "Force, positive when it pulls, triceps short head";
  input SI.Force F_6(start=0) "Force, positive when it pulls, brachialis";
  input SI.Force fx(start=0) "External force on the arm at the wrist, world x";
  input SI.Force fy(start=0) "External force on the arm at the wrist, world y";
  output SI.Length L_1 "Length of muscle and tendon, anterior deltoid";
  output SI.Length L_2 "Length of muscle and tendon, posterior deltoid";
  output SI.Length L_3 "Length of muscle and tendon, biceps";
  output SI.Length L_4 "Length of muscle and tendon, triceps long head";
  output SI.Length L_5 "Length of muscle and tendon, triceps short head";
  output SI.Length L_6 "Length of muscle and tendon, brachialis";
  output SI.Velocity V_1 "Speed of lengthening, anterior deltoid";
  output SI.Velocity V_2 "Speed of lengthening, posterior deltoid";
  output SI.Velocity V_3 "Speed of lengthening, biceps";
  output SI.Velocity V_4 "Speed of lengthening, triceps long head";
  output SI.Velocity V_5 "Speed of lengthening, triceps short head";
  output SI.Velocity V_6 "Speed of lengthening, brachialis";
  output SI.Angle q1 "Shoulder angle from the world x axis, flexion positive";
  output SI.Angle q2 "Elbow angle relative to the upper arm, flexion positive";
  FESArm.Linkage.PlanarLinkage linkage;
protected
  SI.Force F[6] "Forces";
  SI.Length L[6] "Lengths";
  SI.Velocity V[6] "= der(L)";
equation
  F = {F_1, F_2, F_3, F_4, F_5, F_6};
  for i in 1:6 loop
    L[i] = a0[i] - d1[i]*linkage.q[1] - d2[i]*linkage.q[2];
    V[i] = -d1[i]*linkage.w[1] - d2[i]*linkage.w[2];
  end for;
  linkage.tau[1] = d1[1]*F[1] + d1[2]*F[2] + d1[3]*F[3] + d1[4]*F[4] + d1[5]*F[5] + d1[6]*F[6];
  linkage.tau[2] = d2[1]*F[1] + d2[2]*F[2] + d2[3]*F[3] + d2[4]*F[4] + d2[5]*F[5] + d2[6]*F[6];
  linkage.f = {fx, fy};
  linkage.g = {0, 0};
  L_1 = L[1];
  L_2 = L[2];
  L_3 = L[3];
  L_4 = L[4];
  L_5 = L[5];
  L_6 = L[6];
  V_1 = V[1];
  V_2 = V[2];
  V_3 = V[3];
  V_4 = V[4];
  V_5 = V[5];
  V_6 = V[6];
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
