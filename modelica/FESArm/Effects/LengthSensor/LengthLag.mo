within FESArm.Effects.LengthSensor;
model LengthLag "Readings that follow the length with a lag"
  import SI = FESArm.Units;
  extends PartialLengthSensor;
  parameter SI.Time tau(min=0.001, max=100) = 0.02 "Time constant";
  SI.Length r[n](each start=0, each fixed=true) "Readings";
equation
  for i in 1:n loop
    der(r[i]) = (x[i] - r[i])/tau;
    y[i] = r[i];
  end for;
  annotation (Documentation(info="<html>
<p>der(y) = (x - y)/tau: a position encoder behind a filter, or the damped float of a level sensor.</p>
<p>A filter of first order. Source: the first-order instrument of Doebelin, Measurement Systems (2004), chapter 3.</p>
</html>"));
end LengthLag;
