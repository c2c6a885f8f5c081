within FESArm.Test;
model FatigueAndRecovery "At full activation the capacity falls exponentially, at rest it recovers exponentially"
  FESArm.Effects.MuscleStrength.Fatigue fatigue(n=2, TFatigue=3, TRecovery=5, capacity(start={1, 0.2}));
  output Real fallError(unit="1"), riseError(unit="1") "Zero when the law is right";
equation
  fatigue.alpha = {1, 0};
  fallError = fatigue.strength[1] - exp(-time/3);
  riseError = fatigue.strength[2] - (1 - 0.8*exp(-time/5));
  annotation (experiment(StopTime=10));
end FatigueAndRecovery;
