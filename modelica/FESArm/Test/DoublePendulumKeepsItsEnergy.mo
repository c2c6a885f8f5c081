within FESArm.Test;
model DoublePendulumKeepsItsEnergy "Dropped from rest, two links turn height into motion and nothing else"
  FESArm.Plants.DoublePendulum two;
  output Real energyError(unit="J") "Zero when the motion is right";
protected
  FESArm.Units.Velocity v1, vx2, vy2 "Velocities of the centres of mass";
  FESArm.Units.Length y1, y2 "Heights of the centres of mass";
  FESArm.Units.AngularVelocity w12 "Speed of the second link";
equation
  two.correction_q1 = 0;
  two.correction_q2 = 0;
  w12 = two.linkage.w[1] + two.linkage.w[2];
  v1 = two.linkage.c[1]*two.linkage.w[1];
  vx2 = -two.linkage.l[1]*sin(two.q1)*two.linkage.w[1] - two.linkage.c[2]*sin(two.q1 + two.q2)*w12;
  vy2 = two.linkage.l[1]*cos(two.q1)*two.linkage.w[1] + two.linkage.c[2]*cos(two.q1 + two.q2)*w12;
  y1 = two.linkage.c[1]*sin(two.q1);
  y2 = two.linkage.l[1]*sin(two.q1) + two.linkage.c[2]*sin(two.q1 + two.q2);
  energyError = two.linkage.m[1]*v1^2/2 + two.linkage.m[2]*(vx2^2 + vy2^2)/2 + two.linkage.I[1]*two.linkage.w[1]^2/2
    + two.linkage.I[2]*w12^2/2 + two.linkage.m[1]*two.g*y1 + two.linkage.m[2]*two.g*(y2 - two.linkage.c[2]*sin(0.3));
  annotation (experiment(StopTime=2), Documentation(info="<html>
<p>No friction and no input: E = sum of m v^2/2 + I omega^2/2 + m g y over both links is constant. Velocities are
those of the centres of mass, differentiated here from their positions c1 (cos q1, sin q1) and l1 (cos q1, sin q1) +
c2 (cos(q1 + q2), sin(q1 + q2)), not taken from the mass matrix. At the start both are at rest at the heights 0 and c2
sin(0.3).</p>
</html>"));
end DoublePendulumKeepsItsEnergy;
