within FESArm.Effects.StimulationPath;
model StimulationDelay "Pure delay of the commands"
  import SI = FESArm.Units;
  extends PartialStimulationPath;
  parameter SI.Time T(min=0, max=0.2) = 0.02 "Delay, the same for all channels";
  ChannelDelay channel[n](each T=T);
equation
  channel.u = u;
  y = channel.y;
  annotation (Documentation(info="<html>
<p>y(t) = u(t - T), exact transport, no approximation by a lag.</p>
<p>Before t = T the activation is the first command. One delay for all channels, which does not change within a run.
Derived here: conduction and the period of the pulses as one transport time.</p>
</html>"));
end StimulationDelay;
