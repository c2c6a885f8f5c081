within FESArm.Linkage;
model PlanarLinkage "Two links in a horizontal plane"
  import SI = FESArm.Units;
  parameter SI.Length l[2] = {0.33, 0.32} "Lengths of upper arm and forearm with hand";
  parameter SI.Mass m[2] = {1.93, 1.52} "Masses";
  parameter SI.Length c[2] = {0.165, 0.19} "Centres of mass, from the proximal joint";
  parameter SI.Inertia I[2] = {0.0141, 0.0188} "Inertias about the centres of mass";
  parameter SI.RotationalDamping b[2] = {0.30, 0.30} "Viscous damping of the joints";
  input SI.Torque tau[2] "Joint torques, positive in the direction of flexion";
  input SI.Force f[2] "Force on the arm at the wrist, world axes";
  input SI.Acceleration g[2] "Field that acts on all masses, world axes";
  output SI.Angle q[2](start={0.8, 1.2}, each fixed=true) "Shoulder from the world x axis; elbow relative to the upper arm";
  output SI.AngularVelocity w[2](each start=0, each fixed=true) "= der(q)";
  output SI.AngularAcceleration a[2] "= der(w)";
  output SI.Length r[2] "Position of the wrist, world axes";
  output SI.Velocity v[2] "= der(r)";
  output SI.Acceleration vdot[2] "= der(v)";
protected
  SI.Inertia M[2, 2] "Mass matrix";
  SI.Torque h[2] "Centripetal and Coriolis torques";
  SI.Length J[2, 2] "Jacobian of the wrist position";
  SI.Factor s1, c1 "Sine and cosine of the upper arm's direction";
  SI.Factor sElbow, cElbow "Sine and cosine of the elbow angle";
  SI.Factor s12, c12 "Sine and cosine of the forearm's direction";
  SI.AngularVelocity w12 "Speed of the forearm's direction";
equation
  s1 = sin(q[1]);
  c1 = cos(q[1]);
  sElbow = sin(q[2]);
  cElbow = cos(q[2]);
  s12 = s1*cElbow + c1*sElbow;
  c12 = c1*cElbow - s1*sElbow;
  w12 = w[1] + w[2];
  M[1, 1] = I[1] + I[2] + m[1]*c[1]^2 + m[2]*(l[1]^2 + c[2]^2 + 2*l[1]*c[2]*cElbow);
  M[1, 2] = I[2] + m[2]*(c[2]^2 + l[1]*c[2]*cElbow);
  M[2, 1] = M[1, 2];
  M[2, 2] = I[2] + m[2]*c[2]^2;
  h[1] = -m[2]*l[1]*c[2]*sElbow*(2*w[1]*w[2] + w[2]^2);
  h[2] = m[2]*l[1]*c[2]*sElbow*w[1]^2;
  J[1, 1] = -l[1]*s1 - l[2]*s12;
  J[1, 2] = -l[2]*s12;
  J[2, 1] = l[1]*c1 + l[2]*c12;
  J[2, 2] = l[2]*c12;
  der(q) = w;
  der(w) = a;
  M[1, 1]*a[1] + M[1, 2]*a[2] + h[1] + b[1]*w[1] = tau[1] + J[1, 1]*f[1] + J[2, 1]*f[2]
    + m[1]*c[1]*(c1*g[2] - s1*g[1]) + m[2]*(l[1]*(c1*g[2] - s1*g[1]) + c[2]*(c12*g[2] - s12*g[1]));
  M[2, 1]*a[1] + M[2, 2]*a[2] + h[2] + b[2]*w[2] = tau[2] + J[1, 2]*f[1] + J[2, 2]*f[2]
    + m[2]*c[2]*(c12*g[2] - s12*g[1]);
  r[1] = l[1]*c1 + l[2]*c12;
  r[2] = l[1]*s1 + l[2]*s12;
  v[1] = J[1, 1]*w[1] + J[1, 2]*w[2];
  v[2] = J[2, 1]*w[1] + J[2, 2]*w[2];
  vdot[1] = J[1, 1]*a[1] + J[1, 2]*a[2] - l[1]*c1*w[1]^2 - l[2]*c12*w12^2;
  vdot[2] = J[2, 1]*a[1] + J[2, 2]*a[2] - l[1]*s1*w[1]^2 - l[2]*s12*w12^2;
  annotation (Documentation(info="<html>
<p>M(q) a + h(q, w) + b w = tau + J(q)' f + weights in the field g, which is zero in a level plane. Angles are flexion
positive. The link data are the nominal ones of this project; the study does not print any.</p>
<p>Rigid links in one plane, viscous damping at the joints, no friction otherwise. Source: Lagrange's equations of the
planar elbow manipulator, Spong, Hutchinson, Vidyasagar, Robot Modeling and Control (2006), chapter 7, with the second
angle relative to the first link.</p>
</html>"));
end PlanarLinkage;
