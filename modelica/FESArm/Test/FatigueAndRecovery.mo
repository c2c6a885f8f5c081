within FESArm.Test;
model FatigueAndRecovery "At full activation the capacity falls exponentially, at rest it recovers exponentially"
  FESArm.Effects.MuscleStrength.Fatigue fatigue(n=2, TFatigue=3, TRecovery=5, capacity(start={1, 0.2}));
  output Real fallError(unit="1"), riseError(unit="1") "Zero when the law is right";
equation
  fatigue.alpha = {1, 0};
  fallError = fatigue.strength[1] - exp(-time/3);
  riseError = fatigue.strength[2] - (1 - 0.8*exp(-time/5));
  annotation (experiment(StopTime=10), Documentation(info="<html>
<p>At alpha = 1: der(c) = -c/TFatigue, c(0) = 1 has c = exp(-t/TFatigue). At alpha = 0: der(c) = (1 - c)/TRecovery,
c(0) = 0.2 has c = 1 - 0.8 exp(-t/TRecovery).</p>
</html>"));
end FatigueAndRecovery;
