within FESArm.Test;
model FreeLinkageKeepsItsEnergy "Without damping, torque and force the kinetic energy stays what it was"
  import SI = FESArm.Units;
  FESArm.Linkage.PlanarLinkage linkage(b={0, 0}, w(start={2, -3}));
  output Real energyError(unit="J") "Zero when the motion is right";
protected
  Real energy(unit="J") "Kinetic energy of both links";
  SI.Velocity vx2, vy2 "Speed of the second centre of mass";
  Real start "Kinetic energy in J at the start, q = {0.8, 1.2}, w = {2, -3} rad/s inserted as numbers";
equation
  linkage.tau = {0, 0};
  linkage.f = {0, 0};
  linkage.g = {0, 0};
  vx2 = -linkage.l[1]*sin(linkage.q[1])*linkage.w[1] - linkage.c[2]*sin(linkage.q[1] + linkage.q[2])*(linkage.w[1] + linkage.w[2]);
  vy2 = linkage.l[1]*cos(linkage.q[1])*linkage.w[1] + linkage.c[2]*cos(linkage.q[1] + linkage.q[2])*(linkage.w[1] + linkage.w[2]);
  energy = (linkage.I[1] + linkage.m[1]*linkage.c[1]^2)*linkage.w[1]^2/2
    + linkage.I[2]*(linkage.w[1] + linkage.w[2])^2/2 + linkage.m[2]*(vx2^2 + vy2^2)/2;
  start = (linkage.I[1] + linkage.m[1]*linkage.c[1]^2)*2 + linkage.I[2]/2
    + linkage.m[2]*((2*linkage.l[1])^2 + linkage.c[2]^2 - 4*linkage.l[1]*linkage.c[2]*cos(1.2))/2;
  energyError = energy - start;
  annotation (experiment(StopTime=10));
end FreeLinkageKeepsItsEnergy;
