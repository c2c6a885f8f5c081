within FESArm.Effects.LengthSensor;
model LengthScale "Scale error of a sensor of length"
  import SI = FESArm.Units;
  extends PartialLengthSensor;
  parameter SI.Factor scale[n](each min=0.02, each max=50) = ones(n) "Reading over true length";
equation
  for i in 1:n loop
    y[i] = scale[i]*x[i];
  end for;
  annotation (Documentation(info="<html>
<p>y = scale x: a wrong number of counts for a length.</p>
<p>Zero stays zero. Source: the linear sensor model of textbooks, for example Doebelin, Measurement Systems (2004),
chapter 3.</p>
</html>"));
end LengthScale;
