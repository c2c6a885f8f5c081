within FESArm.Effects.StimulationPath;
partial model PartialStimulationPath "Contract: from commanded to actual activation"
  import SI = FESArm.Units;
  parameter Boolean present = true "False in the absent effect only";
  parameter Integer n = 6 "Number of channels";
  input SI.Fraction u[n] "Commanded activations";
  output SI.Fraction y[n] "Activations behind this effect";
end PartialStimulationPath;
