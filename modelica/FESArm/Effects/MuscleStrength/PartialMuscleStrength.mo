within FESArm.Effects.MuscleStrength;
partial model PartialMuscleStrength "Contract: factor on the active force of each muscle"
  import SI = FESArm.Units;
  parameter Boolean present = true "False in the absent effect only";
  parameter Integer n = 6 "Number of muscles";
  input SI.Fraction alpha[n] "Activations";
  output SI.Factor strength[n] "Factor on the active force";
end PartialMuscleStrength;
