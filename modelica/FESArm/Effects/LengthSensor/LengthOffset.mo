within FESArm.Effects.LengthSensor;
model LengthOffset "Zero error of a sensor of length"
  import SI = FESArm.Units;
  extends PartialLengthSensor;
  parameter SI.Length offset[n] = zeros(n) "Reading minus true length";
equation
  y = x + offset;
  annotation (Documentation(info="<html>
<p>y = x + offset: a zero that was set at the wrong place.</p>
<p>Constant: a wrong zero. Source: the linear sensor model of textbooks, for example Doebelin, Measurement Systems
(2004), chapter 3.</p>
</html>"));
end LengthOffset;
