within FESArm.Test;
model RecruitmentAtKnownCommands "Static maps from command to activation where their values are plain"
  FESArm.Effects.StimulationPath.RecruitmentCurve curve(n=5, threshold=0.1, full=0.7);
  FESArm.Effects.StimulationPath.Saturation saturation(n=3, ceiling=0.8);
  FESArm.Effects.StimulationPath.SigmoidRecruitment middle(n=3, centre=0.5, steepness=6);
  FESArm.Effects.StimulationPath.SigmoidRecruitment early(n=3, centre=0.3, steepness=8);
  FESArm.Effects.StimulationPath.Crosstalk crosstalk(n=3, gain={{0, 0.2, 0.5}, {0, 0, 0}, {0, 0, 0}});
  output Real curveError(unit="1"), saturationError(unit="1"), sigmoidError(unit="1"), crosstalkError(unit="1")
    "Zero when the laws are right";
equation
  curve.u = {0, 0.1, 0.4, 0.7, 1};
  curveError = sum(abs(curve.y - {0, 0, 0.5, 1, 1}));
  saturation.u = {0.3, 0.8, 1};
  saturationError = sum(abs(saturation.y - {0.3, 0.8, 0.8}));
  middle.u = {0, 0.5*time, 1 - 0.5*time};
  early.u = {0, 0.3, 1};
  sigmoidError = abs(middle.y[1]) + abs(middle.y[2] + middle.y[3] - 1) + abs(early.y[1]) + abs(early.y[3] - 1)
    + abs(early.y[2] - (1 + exp(-5.6))*(exp(2.4) - 1)/(2*(exp(2.4) - exp(-5.6))));
  crosstalk.u = {0.5, 0.3, 0.9};
  crosstalkError = sum(abs(crosstalk.y - {0.5, 0.4, 1}));
  annotation (experiment(StopTime=1), Documentation(info="<html>
<p>Dead zone, middle and ceiling of the straight maps; the logistic curve with its steepest point at one half is
point-symmetric, and at any centre it is (1/2 - low)/(high - low) there. Crosstalk adds 0.2 and 0.5 of the first command,
up to the ceiling 1.</p></html>"));
end RecruitmentAtKnownCommands;
