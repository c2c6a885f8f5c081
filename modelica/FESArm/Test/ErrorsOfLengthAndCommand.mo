within FESArm.Test;
model ErrorsOfLengthAndCommand "Faulty readings of a steady motion; commands that are late or too large"
  FESArm.Effects.LengthSensor.LengthOffset offset(n=2, offset={0.1, -0.2});
  FESArm.Effects.LengthSensor.LengthScale scale(n=2, scale={1.1, 0.9});
  FESArm.Effects.LengthSensor.LengthLag lag(n=2, tau=0.05);
  FESArm.Effects.Actuator.ActuatorDelay late(T=0.02);
  FESArm.Effects.Actuator.ActuatorSaturation forwards(ceiling=0.8), backwards(ceiling=0.8), inside(ceiling=0.8);
  FESArm.Effects.Inflow.InflowDelay lateFlow(T=0.1);
  FESArm.Effects.Inflow.InflowCeiling large(ceiling=0.002), small(ceiling=0.002);
  constant Real speed(unit="m/s") = 1 "Speed of the first length; the second is twice as fast";
  constant Real slope(unit="1/s") = 1 "Slope of a command";
  constant Real rise(unit="m3/s2") = 1 "Slope of a flow";
  output Real offsetError(unit="m") "Zero when the law is right";
  output Real scaleError(unit="m") "Zero when the law is right";
  output Real lagError(unit="m") "Zero when the law is right";
  output Real lateError(unit="1") "Zero when the law is right";
  output Real saturationError(unit="1") "Zero when the law is right";
  output Real lateFlowError(unit="m3/s") "Zero when the law is right";
  output Real ceilingError(unit="m3/s") "Zero when the law is right";
protected
  Real lateRamp(unit="m") "The first length behind a lag of 0.05 s";
equation
  offset.x = {speed*time, 2*speed*time};
  scale.x = {speed*time, 2*speed*time};
  lag.x = {speed*time, 2*speed*time};
  offsetError = abs(offset.y[1] - speed*time - 0.1) + abs(offset.y[2] - 2*speed*time + 0.2);
  scaleError = abs(scale.y[1] - 1.1*speed*time) + abs(scale.y[2] - 1.8*speed*time);
  lateRamp = speed*(time - 0.05*(1 - exp(-time/0.05)));
  lagError = abs(lag.y[1] - lateRamp) + abs(lag.y[2] - 2*lateRamp);
  late.u = slope*time;
  lateError = late.y - max(0, slope*(time - 0.02));
  forwards.u = 1.5;
  backwards.u = -1.5;
  inside.u = -0.3;
  saturationError = abs(forwards.y - 0.8) + abs(backwards.y + 0.8) + abs(inside.y + 0.3);
  lateFlow.u = rise*time;
  lateFlowError = lateFlow.y - max(0, rise*(time - 0.1));
  large.u = 0.003;
  small.u = 0.001;
  ceilingError = abs(large.y - 0.002) + abs(small.y - 0.001);
  annotation (experiment(StopTime=0.5), Documentation(info="<html>
<p>A ramp behind a lag tau is speed (t - tau (1 - exp(-t/tau))); a delayed ramp is the same ramp, later.</p></html>"));
end ErrorsOfLengthAndCommand;
