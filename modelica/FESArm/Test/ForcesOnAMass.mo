within FESArm.Test;
model ForcesOnAMass "Under a steady force and in a steady field the ways are parabolas"
  import SI = FESArm.Units;
  parameter SI.Mass m = 2 "Mass";
  FESArm.Effects.WristLoad.ConstantForce force(f0={3, -1});
  FESArm.Effects.Field.GravityTilt tilt(gx=0.5, gy=-0.2);
  SI.Length x(start=0, fixed=true), y(start=0, fixed=true);
  SI.Velocity vx(start=0, fixed=true), vy(start=0, fixed=true);
  output SI.Length xError, yError "Zero when the laws are right";
equation
  der(x) = vx;
  der(y) = vy;
  force.r = {x, y};
  force.v = {vx, vy};
  force.vdot = {0, 0};
  m*der(vx) = force.f[1] + m*tilt.g[1];
  m*der(vy) = force.f[2] + m*tilt.g[2];
  xError = x - time^2;
  yError = y + 0.35*time^2;
  annotation (experiment(StopTime=2), Documentation(info="<html>
<p>The accelerations are 3/2 + 0.5 = 2 m/s2 and -1/2 - 0.2 = -0.7 m/s2.</p></html>"));
end ForcesOnAMass;
