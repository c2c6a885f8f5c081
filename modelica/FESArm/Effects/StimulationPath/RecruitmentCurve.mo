within FESArm.Effects.StimulationPath;
model RecruitmentCurve "Dead zone and early saturation between command and activation"
  import SI = FESArm.Units;
  extends PartialStimulationPath;
  parameter SI.Factor threshold(min=0, max=0.6) = 0.05 "Command below which nothing is recruited";
  parameter SI.Factor full(min=0.4, max=1.6) = 0.95 "Command at which all is recruited";
equation
  for i in 1:n loop
    y[i] = noEvent(min(1, max(0, (u[i] - threshold)/(full - threshold))));
  end for;
  annotation (Documentation(info="<html>
<p>y = (u - threshold)/(full - threshold), kept within 0 and 1.</p>
<p>Static, monotone, the same for every channel. Source: dead zone, linear range and saturation of the isometric
recruitment curve of Durfee and MacLean, Methods for estimating isometric recruitment curves of electrically
stimulated muscle, IEEE Transactions on Biomedical Engineering 36 (1989).</p>
</html>"));
end RecruitmentCurve;
