within FESArm.Test;
model TankEmpties "The root of the level of an emptying tank falls linearly"
  FESArm.Plants.TwoTanks tanks(a1=2e-4);
  output Real levelError(unit="m") "Zero when the law is right";
equation
  tanks.correction_h1 = 0;
  tanks.correction_h2 = 0;
  tanks.correction_outflow = 0;
  tanks.inflow = 0;
  levelError = tanks.h1 - (sqrt(0.3) - tanks.a1/tanks.A1*sqrt(tanks.g/2)*time)^2;
  annotation (experiment(StopTime=5), Documentation(info="<html>
<p>Torricelli: sqrt(h) = sqrt(h0) - a/A sqrt(g/2) t.</p></html>"));
end TankEmpties;
