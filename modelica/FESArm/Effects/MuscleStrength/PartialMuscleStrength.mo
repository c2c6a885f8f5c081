within FESArm.Effects.MuscleStrength;
partial model PartialMuscleStrength "Contract: factor on the active force of each muscle"
  import SI = FESArm.Units;
  parameter Boolean present = true "False in the absent effect only";
  parameter Integer n = 6 "Number of muscles";
  input SI.Fraction alpha[n] "Activations";
  output SI.Factor strength[n] "Factor on the active force";
  annotation (Documentation(info="<html>
<p>F = alpha strength Fmax fL fV + passive force: the factor scales the active force only, tendon and connective
tissue stay what they are. Factors of several slots multiply. Contract of this project, on the muscle law of Zajac
1989 (Critical Reviews in Biomedical Engineering 17, 359-411).</p>
</html>"));
end PartialMuscleStrength;
