within FESArm.Effects.Actuator;
model ActuatorDelay "Pure delay of the command"
  import SI = FESArm.Units;
  extends PartialActuator;
  parameter SI.Time T(min=0, max=0.2) = 0.02 "Delay";
equation
  y = delay(u, T, 0.2);
  annotation (Documentation(info="<html>
<p>y(t) = u(t - T), exact transport, no approximation by a lag.</p>
<p>Before t = T the first command holds. Constant within a run. Derived here: bus and controller as one transport
time.</p>
</html>"));
end ActuatorDelay;
