within FESArm.Effects.StimulationPath;
model ChannelDelay "Pure delay of one signal"
  import SI = FESArm.Units;
  parameter SI.Time T = 0.02 "Delay, at most 0.2 s";
  input SI.Fraction u "Signal";
  output SI.Fraction y "= u(t - T)";
equation
  y = delay(u, T, 0.2);
end ChannelDelay;
