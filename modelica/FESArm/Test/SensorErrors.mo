within FESArm.Test;
model SensorErrors "Readings of faulty sensors of a steadily turning joint and of a known force"
  FESArm.Effects.JointSensor.JointOffset offset(offset={0.1, -0.2});
  FESArm.Effects.JointSensor.JointScale scale(scale={1.1, 0.9});
  FESArm.Effects.JointSensor.SensorLag lag(tau=0.05, r(start={0, 0}));
  FESArm.Effects.ForceSensor.ForceSensorGain gain(gain=1.25);
  FESArm.Effects.ForceSensor.ForceSensorOffset zero(offset={0.5, -0.25});
  output Real offsetError(unit="rad"), scaleError(unit="rad"), lagError(unit="rad") "Zero when the laws are right";
  output Real gainError(unit="N"), zeroError(unit="N") "Zero when the laws are right";
protected
  Real lateRamp(unit="rad") "A ramp of 1 rad/s behind a lag of 0.05 s";
equation
  offset.q = {time, 2*time};
  scale.q = {time, 2*time};
  lag.q = {time, 2*time};
  gain.u = {5, -2.5};
  zero.u = {5, -2.5};
  offsetError = abs(offset.y[1] - time - 0.1) + abs(offset.y[2] - 2*time + 0.2);
  scaleError = abs(scale.y[1] - 1.1*time) + abs(scale.y[2] - 1.8*time);
  lagError = abs(lag.y[1] - lateRamp) + abs(lag.y[2] - 2*lateRamp);
  gainError = abs(gain.f[1] - 4) + abs(gain.f[2] + 2);
  zeroError = abs(zero.f[1] - 4.5) + abs(zero.f[2] + 2.25);
  lateRamp = time - 0.05*(1 - exp(-time/0.05));
  annotation (experiment(StopTime=0.5), Documentation(info="<html>
<p>At the steady speeds 1 and 2 rad/s: q = t and 2 t. Offset: y = q + offset. Scale: y = scale q. Lag: tau der(y) = q
- y with y(0) = 0 and q = s t has y = s (t - tau (1 - exp(-t/tau))). Force sensors are inverted: 5 N read with gain
1.25 are 4 N, and 5 N read with an offset of 0.5 N are 4.5 N. Derived here.</p>
</html>"));
end SensorErrors;
