within FESArm.Effects.JointSensor;
partial model PartialJointSensor "Contract: reading of the encoders"
  import SI = FESArm.Units;
  parameter Boolean present = true "False in the absent effect only";
  parameter Integer n = 2 "Number of joints";
  input SI.Angle q[n] "True angles";
  output SI.Angle y[n] "Readings";
  annotation (Documentation(info="<html>
<p>An effect states the reading y = F(q) of each encoder; it does not act back on the motion. Effects in series
multiply or add in the order of their slots. Quantisation and noise are no part of the model: they belong to the
measurement. Contract of this project.</p>
</html>"));
end PartialJointSensor;
