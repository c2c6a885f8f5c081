within FESArm.Test;
model TankWithOtherFlows "A tank with a valve that is off, or with a leak, empties as one with another outlet"
  FESArm.Plants.TwoTanks valve(
    redeclare model TankFlow1 = FESArm.Effects.TankFlow.OutletError,
    tankFlow1(factor={4, 0}));
  FESArm.Plants.TwoTanks leaking(
    redeclare model TankFlow2 = FESArm.Effects.TankFlow.TankLeak,
    tankFlow2(leak={1.5e-4, 0}),
    a2=0);
  output Real valveError(unit="m") "Zero when the law is right";
  output Real leakError(unit="m") "Zero when the law is right";
  output Real waterError(unit="m3") "Zero when the closed outlet keeps the water in";
  output Real lostError(unit="m3") "Zero when a quarter of what leaves the leaking tank arrives in the next";
equation
  valve.inflow = 0;
  valve.correction_h1 = 0;
  valve.correction_h2 = 0;
  valve.correction_outflow = 0;
  leaking.inflow = 0;
  leaking.correction_h1 = 0;
  leaking.correction_h2 = 0;
  leaking.correction_outflow = 0;
  valveError = valve.h1 - (sqrt(0.3) - 2e-4/valve.A1*sqrt(valve.g/2)*time)^2;
  leakError = leaking.h1 - (sqrt(0.3) - 2e-4/leaking.A1*sqrt(leaking.g/2)*time)^2;
  waterError = valve.A1*(valve.h1 - 0.3) + valve.A2*(valve.h2 - 0.1);
  lostError = 0.25*leaking.A1*(0.3 - leaking.h1) - leaking.A2*(leaking.h2 - 0.1);
  annotation (experiment(StopTime=5), Documentation(info="<html>
<p>Torricelli: sqrt(h) = sqrt(h0) - a/A sqrt(g/2) t, with a the outlet's area times its factor, or plus the leak's; both are
2e-4 m2. A lower outlet with factor 0 lets nothing out.</p></html>"));
end TankWithOtherFlows;
