within FESArm.Effects.JointSensor;
model JointOffset "Zero error of an encoder"
  import SI = FESArm.Units;
  extends PartialJointSensor;
  parameter SI.Angle offset[n] = zeros(n) "Reading minus true angle";
equation
  y = q + offset;
  annotation (Documentation(info="<html>
<p>y = q + offset.</p>
<p>Constant: the encoder was zeroed in another posture. Source: the linear sensor model of textbooks, for example
Doebelin, Measurement Systems (2004), chapter 3.</p>
</html>"));
end JointOffset;
