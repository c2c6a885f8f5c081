within FESArm.Effects.JointSensor;
model SensorLag "Readings that follow the angle with a lag"
  import SI = FESArm.Units;
  extends PartialJointSensor;
  parameter SI.Time tau(min=0.001, max=0.5) = 0.02 "Time constant";
  SI.Angle r[n](each start=1, each fixed=true) "Readings";
equation
  for i in 1:n loop
    der(r[i]) = (q[i] - r[i])/tau;
    y[i] = r[i];
  end for;
  annotation (Documentation(info="<html>
<p>der(y) = (q - y)/tau.</p>
<p>A filter of first order, the same for all joints; below 1/(2 pi tau) it acts as a delay of tau. Source: the
first-order instrument of Doebelin, Measurement Systems (2004), chapter 3.</p>
</html>"));
end SensorLag;
