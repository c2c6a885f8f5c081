within FESArm.Test;
model TanksKeepTheirWater "Water in the tanks and water that left them is what was there and what came in"
  FESArm.Plants.TwoTanks tanks;
  output Real volumeError(unit="m3") "Zero when no water is lost";
  FESArm.Units.Volume left(start=0, fixed=true) "Water that has left the lower tank";
equation
  tanks.correction_h1 = 0;
  tanks.correction_h2 = 0;
  tanks.correction_outflow = 0;
  tanks.inflow = 1e-4;
  der(left) = tanks.outflow;
  volumeError = tanks.A1*(tanks.h1 - 0.3) + tanks.A2*(tanks.h2 - 0.1) + left - 1e-4*time;
  annotation (experiment(StopTime=60), Documentation(info="<html>
<p>A1 der(h1) + A2 der(h2) = inflow - outflow, whatever flows between the tanks. Integrated: A1 (h1 - h1(0)) + A2 (h2
- h2(0)) + outflow so far = inflow t at a constant inflow.</p>
</html>"));
end TanksKeepTheirWater;
