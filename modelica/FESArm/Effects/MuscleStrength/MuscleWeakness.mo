within FESArm.Effects.MuscleStrength;
model MuscleWeakness "The strength of a muscle is off by a factor"
  import SI = FESArm.Units;
  extends PartialMuscleStrength;
  parameter SI.Factor factor[n](each min=0, each max=3) = ones(n) "Actual over nominal strength of each muscle";
equation
  strength = factor;
  annotation (Documentation(info="<html>
<p>strength = factor. Below 1 the muscle is weak, above 1 stronger than nominal.</p>
<p>Constant within a run; the passive force stays. Derived here: the factor multiplies Fmax of the active force.</p>
</html>"));
end MuscleWeakness;
