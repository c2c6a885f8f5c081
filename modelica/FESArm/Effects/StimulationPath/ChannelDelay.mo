within FESArm.Effects.StimulationPath;
model ChannelDelay "Pure delay of one signal"
  import SI = FESArm.Units;
  parameter SI.Time T = 0.02 "Delay, at most 0.2 s";
  input SI.Fraction u "Signal";
  output SI.Fraction y "= u(t - T)";
equation
  y = delay(u, T, 0.2);
  annotation (Documentation(info="<html>
<p>y(t) = u(t - T), for t &lt; T the first value of u: Modelica's <code>delay(u, T, Tmax)</code> (source: Modelica
Language Specification 3.6, chapter 3) with Tmax = 0.2 s. T may be changed between runs, not within one. A pure
transport delay, such as that of pulse period and conduction; there is no lag in it.</p>
</html>"));
end ChannelDelay;
