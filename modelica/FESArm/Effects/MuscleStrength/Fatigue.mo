within FESArm.Effects.MuscleStrength;
model Fatigue "Capacity falls with activation and recovers at rest"
  import SI = FESArm.Units;
  extends PartialMuscleStrength;
  parameter SI.Time TFatigue(min=1, max=1000) = 30 "Time constant of the fall at full activation";
  parameter SI.Time TRecovery(min=1, max=1000) = 60 "Time constant of the recovery at rest";
  SI.Fraction capacity[n](each start=1, each fixed=true) "Share of the strength that is left";
equation
  for i in 1:n loop
    der(capacity[i]) = -alpha[i]*capacity[i]/TFatigue + (1 - alpha[i])*(1 - capacity[i])/TRecovery;
    strength[i] = capacity[i];
  end for;
  annotation (Documentation(info="<html>
<p>der(c) = -alpha c/TFatigue + (1 - alpha) (1 - c)/TRecovery for every muscle.</p></html>"));
end Fatigue;
