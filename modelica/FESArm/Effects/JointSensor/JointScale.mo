within FESArm.Effects.JointSensor;
model JointScale "Scale error of an encoder"
  import SI = FESArm.Units;
  extends PartialJointSensor;
  parameter SI.Factor scale[n](each min=0.02, each max=50) = ones(n) "Reading over true angle";
equation
  for i in 1:n loop
    y[i] = scale[i]*q[i];
  end for;
  annotation (Documentation(info="<html>
<p>y = scale q.</p>
<p>A wrong count per turn or a wrong gear ratio: zero stays zero. Source: the linear sensor model of textbooks, for
example Doebelin, Measurement Systems (2004), chapter 3.</p>
</html>"));
end JointScale;
