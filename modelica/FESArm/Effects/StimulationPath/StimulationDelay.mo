within FESArm.Effects.StimulationPath;
model StimulationDelay "Pure delay of the commands"
  extends PartialStimulationPath;
  parameter SI.Time T(min=0, max=0.2) = 0.02 "Delay, the same for all channels";
equation
  for i in 1:n loop
    y[i] = delay(u[i], T, 0.2);
  end for;
  annotation (Documentation(info="<html><p>y(t) = u(t - T), exact transport, no approximation by a lag.</p></html>"));
end StimulationDelay;
