within FESArm.Test;
model DragOfACoastingMass "A mass that only drag slows down has the speed v0/(1 + c v0 t/m)"
  import SI = FESArm.Units;
  parameter SI.Mass m = 2 "Mass";
  parameter SI.Velocity v0 = 3 "Speed at the start, in the direction (0.6, 0.8)";
  FESArm.Effects.WristLoad.QuadraticDrag drag(c=0.5);
  SI.Velocity vx(start=0.6*v0, fixed=true), vy(start=0.8*v0, fixed=true);
  output SI.Velocity xError, yError "Zero when the law is right";
equation
  drag.r = {0, 0};
  drag.v = {vx, vy};
  drag.vdot = {0, 0};
  m*der(vx) = drag.f[1];
  m*der(vy) = drag.f[2];
  xError = vx - 0.6*v0/(1 + drag.c*v0*time/m);
  yError = vy - 0.8*v0/(1 + drag.c*v0*time/m);
  annotation (experiment(StopTime=2), Documentation(info="<html>
<p>m der(v) = -c v^2 along the path. The law's rounding of |v| near rest changes nothing above 1 mm/s.</p></html>"));
end DragOfACoastingMass;
