within FESArm.Effects.MuscleStrength;
model MuscleWeakness "The strength of one muscle is off by a factor"
  import SI = FESArm.Units;
  extends PartialMuscleStrength;
  parameter Integer muscle(min=1) = 1 "Which muscle";
  parameter SI.Factor factor(min=0, max=3) = 0.8 "Actual over nominal strength";
equation
  for i in 1:n loop
    strength[i] = if i == muscle then factor else 1;
  end for;
  annotation (Documentation(info="<html><p>Below 1 the muscle is weak, above 1 stronger than nominal.</p></html>"));
end MuscleWeakness;
