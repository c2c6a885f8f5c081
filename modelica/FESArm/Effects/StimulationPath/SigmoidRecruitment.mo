within FESArm.Effects.StimulationPath;
model SigmoidRecruitment "S-shaped recruitment between command and activation"
  import SI = FESArm.Units;
  extends PartialStimulationPath;
  parameter SI.Factor centre(min=0.05, max=0.95) = 0.5 "Command at which recruitment is steepest";
  parameter SI.Factor steepness(min=0.5, max=40) = 4 "Slope of the logistic curve";
protected
  Real low(unit="1") "Curve at command 0";
  Real high(unit="1") "Curve at command 1";
equation
  low = 1/(1 + exp(steepness*centre));
  high = 1/(1 + exp(-steepness*(1 - centre)));
  for i in 1:n loop
    y[i] = (1/(1 + exp(-steepness*(u[i] - centre))) - low)/(high - low);
  end for;
  annotation (Documentation(info="<html>
<p>A logistic curve, scaled so that commands 0 and 1 stay 0 and 1.</p>
<p>y = (s(u) - s(0))/(s(1) - s(0)) with s(u) = 1/(1 + exp(-steepness (u - centre))). Static, monotone, the same for
every channel. The logistic form is chosen here; source of the S shape: Durfee and MacLean, Methods for estimating
isometric recruitment curves of electrically stimulated muscle, IEEE Transactions on Biomedical Engineering 36
(1989).</p>
</html>"));
end SigmoidRecruitment;
