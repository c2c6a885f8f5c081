within FESArm.Effects.MuscleStrength;
model Fatigue "Capacity falls with activation and recovers at rest"
  import SI = FESArm.Units;
  extends PartialMuscleStrength;
  parameter SI.Time TFatigue(min=1, max=1e6) = 30 "Time constant of the fall at full activation";
  parameter SI.Time TRecovery(min=1, max=1e6) = 60 "Time constant of the recovery at rest";
  SI.Fraction capacity[n](each start=1, each fixed=true) "Share of the strength that is left";
equation
  for i in 1:n loop
    der(capacity[i]) = -alpha[i]*capacity[i]/TFatigue + (1 - alpha[i])*(1 - capacity[i])/TRecovery;
    strength[i] = capacity[i];
  end for;
  annotation (Documentation(info="<html>
<p>der(c) = -alpha c/TFatigue + (1 - alpha) (1 - c)/TRecovery for every muscle.</p>
<p>alpha = 1 drives the capacity to 0, alpha = 0 back to 1, each as an exponential; in between it settles at TFatigue
(1 - alpha)/(TFatigue (1 - alpha) + TRecovery alpha). The passive force does not tire, and the muscle's speed does not
slow down. Source: a first-order capacity as in Riener, Quintern and Schmidt, Biomechanical model of the human knee
evaluated by neuromuscular stimulation, Journal of Biomechanics 29 (1996), with activation and rest as the two drives
and no floor. The highest TFatigue is no limit of muscles but absence: accurate encoders show in ten seconds that a muscle would
tire over an hour.</p>
</html>"));
end Fatigue;
