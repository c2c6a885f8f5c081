within FESArm.Plants;
model TwoTanks "Two tanks, the first empties into the second"
  import SI = FESArm.Units;
  parameter SI.Area A1 = 0.015 "Cross section of the upper tank";
  parameter SI.Area A2 = 0.015 "Cross section of the lower tank";
  parameter SI.Area a1 = 5e-5 "Effective area of the upper outlet";
  parameter SI.Area a2 = 5e-5 "Effective area of the lower outlet";
  parameter SI.Acceleration g = 9.81 "Gravity";
  parameter SI.Length hSmall = 1e-4 "Level below which the outflow is no longer Torricelli's";
  input SI.VolumeFlowRate inflow(start=0) "Flow into the upper tank";
  output SI.Length h1(start=0.3, fixed=true) "Level in the upper tank";
  output SI.Length h2(start=0.1, fixed=true) "Level in the lower tank";
  output SI.VolumeFlowRate outflow "Flow out of the lower tank";
protected
  SI.VolumeFlowRate between "Flow from the upper to the lower tank";
equation
  between = a1*sqrt(2*g)*h1/sqrt(sqrt(h1^2 + hSmall^2));
  outflow = a2*sqrt(2*g)*h2/sqrt(sqrt(h2^2 + hSmall^2));
  A1*der(h1) = inflow - between;
  A2*der(h2) = between - outflow;
  annotation (Documentation(info="<html>
<p>A der(h) = flow in - flow out, with Torricelli's outflow a sqrt(2 g h), regularised as
a sqrt(2 g) h/(h^2 + hSmall^2)^(1/4): smooth through zero, off by (hSmall/h)^2/4 of itself. Neither tank overflows. There are no
correction inputs: the levels are states of first order. Cross sections are those of a laboratory rig, chosen for this
project.</p>
</html>"));
end TwoTanks;
