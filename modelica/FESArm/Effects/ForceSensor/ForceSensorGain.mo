within FESArm.Effects.ForceSensor;
model ForceSensorGain "Scale error of the force sensor"
  import SI = FESArm.Units;
  extends PartialForceSensor;
  parameter SI.Factor gain(min=0.2, max=5) = 1.05 "Reading over true force";
equation
  f = u/gain;
  annotation (Documentation(info="<html>
<p>reading = gain * force.</p>
<p>The same for both axes, no lag, no cross-talk between the axes. Source: the linear sensor model of textbooks, for
example Doebelin, Measurement Systems (2004), chapter 3.</p>
</html>"));
end ForceSensorGain;
