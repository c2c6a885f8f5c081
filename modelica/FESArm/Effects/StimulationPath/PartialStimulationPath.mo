within FESArm.Effects.StimulationPath;
partial model PartialStimulationPath "Contract: from commanded to actual activation"
  import SI = FESArm.Units;
  parameter Boolean present = true "False in the absent effect only";
  parameter Integer n = 6 "Number of channels";
  input SI.Fraction u[n] "Commanded activations";
  output SI.Fraction y[n] "Activations behind this effect";
  annotation (Documentation(info="<html>
<p>An effect states y = F(u) for all channels, static or with states. Paths stand in series, command first, so their
order matters where one of them is not linear. Commands and activations are shares of full activation, from 0 to 1.
Contract of this project.</p>
</html>"));
end PartialStimulationPath;
