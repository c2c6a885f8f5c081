within FESArm.Test;
model LagOfAStep "Activation after a step up is an exponential with tauUp, after a step down with tauDown"
  FESArm.Effects.StimulationPath.ActivationDynamics up(n=1, tauUp=0.03, tauDown=0.05);
  FESArm.Effects.StimulationPath.ActivationDynamics down(n=1, tauUp=0.03, tauDown=0.05, a(start={1}));
  output Real upError(unit="1") "Zero when the law is right";
  output Real downError(unit="1") "Zero when the law is right";
equation
  up.u = {1};
  down.u = {0};
  upError = up.y[1] - (1 - exp(-time/up.tauUp));
  downError = down.y[1] - exp(-time/down.tauDown);
  annotation (experiment(StopTime=0.3), Documentation(info="<html>
<p>tau der(a) = u - a. For u = 1, a(0) = 0: a = 1 - exp(-t/tauUp). For u = 0, a(0) = 1: a = exp(-t/tauDown).</p>
</html>"));
end LagOfAStep;
