within FESArm.Test;
model FreeLinkageKeepsItsEnergy "Without damping, torque and force the kinetic energy stays what it was"
  import SI = FESArm.Units;
  parameter SI.Angle q0[2] = {0.8, 1.2} "Angles at the start";
  parameter SI.AngularVelocity w0[2] = {2, -3} "Speeds at the start";
  FESArm.Linkage.PlanarLinkage linkage(b={0, 0}, q(start=q0), w(start=w0));
  output Real energyError(unit="J") "Zero when the motion is right";
protected
  Real energy(unit="J") "Kinetic energy of both links";
  SI.Velocity vx2, vy2 "Speed of the second centre of mass";
  Real start(unit="J") "Kinetic energy at the start";
equation
  linkage.tau = {0, 0};
  linkage.f = {0, 0};
  linkage.g = {0, 0};
  vx2 = -linkage.l[1]*sin(linkage.q[1])*linkage.w[1] - linkage.c[2]*sin(linkage.q[1] + linkage.q[2])*(linkage.w[1] + linkage.w[2]);
  vy2 = linkage.l[1]*cos(linkage.q[1])*linkage.w[1] + linkage.c[2]*cos(linkage.q[1] + linkage.q[2])*(linkage.w[1] + linkage.w[2]);
  energy = (linkage.I[1] + linkage.m[1]*linkage.c[1]^2)*linkage.w[1]^2/2
    + linkage.I[2]*(linkage.w[1] + linkage.w[2])^2/2 + linkage.m[2]*(vx2^2 + vy2^2)/2;
  start = (linkage.I[1] + linkage.m[1]*linkage.c[1]^2)*w0[1]^2/2 + linkage.I[2]*(w0[1] + w0[2])^2/2
    + linkage.m[2]*((linkage.l[1]*w0[1])^2 + (linkage.c[2]*(w0[1] + w0[2]))^2
    + 2*linkage.l[1]*linkage.c[2]*w0[1]*(w0[1] + w0[2])*cos(q0[2]))/2;
  energyError = energy - start;
  annotation (experiment(StopTime=10), Documentation(info="<html>
<p>E = (I1 + m1 c1^2) w1^2/2 + I2 (w1 + w2)^2/2 + m2 |v2|^2/2 is constant. |v2|^2 = (l1 w1)^2 + (c2 (w1 + w2))^2 + 2
l1 c2 w1 (w1 + w2) cos(q2) at the start, by the law of cosines for the two parts of v2; later it is taken from the
components of v2.</p>
</html>"));
end FreeLinkageKeepsItsEnergy;
