within FESArm.Effects.ForceSensor;
model ForceSensorOffset "Zero error of the force sensor"
  import SI = FESArm.Units;
  extends PartialForceSensor;
  parameter SI.Force offset[2] = {0.1, 0.1} "Reading minus true force, world axes";
equation
  f = u - offset;
  annotation (Documentation(info="<html>
<p>reading = force + offset.</p>
<p>Constant within a run: drift is left out. Source: the linear sensor model of textbooks, for example Doebelin,
Measurement Systems (2004), chapter 3.</p>
</html>"));
end ForceSensorOffset;
