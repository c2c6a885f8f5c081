within FESArm.Plants;
model TwoTanks "Two tanks, the first empties into the second"
  import SI = FESArm.Units;
  import FESArm.Effects.TankFlow;
  import FESArm.Effects.LengthSensor;
  import FESArm.Effects.Inflow;
  parameter SI.Area A1 = 0.015 "Cross section of the upper tank";
  parameter SI.Area A2 = 0.015 "Cross section of the lower tank";
  parameter SI.Area a1 = 5e-5 "Effective area of the upper outlet";
  parameter SI.Area a2 = 5e-5 "Effective area of the lower outlet";
  parameter SI.Acceleration g = 9.81 "Gravity";
  parameter SI.Length hSmall = 1e-4 "Level below which the outflow is no longer Torricelli's";
  input SI.VolumeFlowRate inflow(start=0) "Flow into the upper tank";
  input SI.VolumeFlowRate correction_h1(start=0) "Flow into the upper tank beside the model's own";
  input SI.VolumeFlowRate correction_h2(start=0) "Flow into the lower tank beside the model's own";
  input SI.VolumeFlowRate correction_outflow(start=0) "Reading of the outflow beside the model's own";
  output SI.Length h1 "Reading of the level in the upper tank";
  output SI.Length h2 "Reading of the level in the lower tank";
  output SI.VolumeFlowRate outflow "Reading of the flow out of the lower tank";
  SI.Length level1(start=0.3, fixed=true) "Level in the upper tank";
  SI.Length level2(start=0.1, fixed=true) "Level in the lower tank";
  replaceable model Inflow1 = Inflow.IdealInflow constrainedby Inflow.PartialInflow;
  Inflow1 inflow1;
  replaceable model Inflow2 = Inflow.IdealInflow constrainedby Inflow.PartialInflow;
  Inflow2 inflow2;
  replaceable model TankFlow1 = TankFlow.NoTankFlow constrainedby TankFlow.PartialTankFlow;
  TankFlow1 tankFlow1(n=2);
  replaceable model TankFlow2 = TankFlow.NoTankFlow constrainedby TankFlow.PartialTankFlow;
  TankFlow2 tankFlow2(n=2);
  replaceable model LevelSensor1 = LengthSensor.TrueLengthSensor constrainedby LengthSensor.PartialLengthSensor;
  LevelSensor1 levelSensor1(n=2);
  replaceable model LevelSensor2 = LengthSensor.TrueLengthSensor constrainedby LengthSensor.PartialLengthSensor;
  LevelSensor2 levelSensor2(n=2);
protected
  SI.VolumeFlowRate leaving "Flow out of the lower tank by its outlet, as modelled";
  SI.VolumeFlowRate between "Flow from the upper to the lower tank";
equation
  between = a1*sqrt(2*g)*level1/sqrt(sqrt(level1^2 + hSmall^2));
  leaving = a2*sqrt(2*g)*level2/sqrt(sqrt(level2^2 + hSmall^2));
  inflow1.u = inflow;
  inflow2.u = inflow1.y;
  tankFlow1.h = {level1, level2};
  tankFlow1.u = {between, leaving};
  tankFlow2.h = {level1, level2};
  tankFlow2.u = {between, leaving};
  levelSensor1.x = {level1, level2};
  levelSensor2.x = levelSensor1.y;
  h1 = levelSensor2.y[1];
  h2 = levelSensor2.y[2];
  outflow = leaving + tankFlow1.outlet[2] + tankFlow2.outlet[2] + correction_outflow;
  A1*der(level1) = inflow2.y - between - tankFlow1.outlet[1] - tankFlow2.outlet[1] - tankFlow1.lost[1]
    - tankFlow2.lost[1] + correction_h1;
  A2*der(level2) = between + tankFlow1.outlet[1] + tankFlow2.outlet[1] - leaving - tankFlow1.outlet[2]
    - tankFlow2.outlet[2] - tankFlow1.lost[2] - tankFlow2.lost[2] + correction_h2;
  annotation (Documentation(info="<html>
<p>A der(h) = flow in - flow out, with Torricelli's outflow a sqrt(2 g h), regularised as
a sqrt(2 g) h/(h^2 + hSmall^2)^(1/4): smooth through zero, off by (hSmall/h)^2/4 of itself. Neither tank overflows. The
corrections of the levels are flows: the levels are states of first order. Slots hold errors of the pump, valves and leaks,
and errors of the level sensors. Cross sections are those of a laboratory rig, chosen for this
project.</p>
</html>"));
end TwoTanks;
