within FESArm.Test;
model DelayOfARamp "A delayed ramp is the same ramp, later; before that it holds its first value"
  FESArm.Effects.StimulationPath.StimulationDelay late(n=1, T=0.02);
  constant Real slope(unit="1/s") = 1 "Slope of the ramp";
  output Real yError(unit="1") "Zero when the law is right";
equation
  late.u = {slope*time};
  yError = late.y[1] - max(0, slope*(time - late.T));
  annotation (experiment(StopTime=0.3), Documentation(info="<html>
<p>u = s t for t &ge; 0 and 0 before has u(t - T) = max(0, s (t - T)).</p>
</html>"));
end DelayOfARamp;
