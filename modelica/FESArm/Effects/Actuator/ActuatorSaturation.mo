within FESArm.Effects.Actuator;
model ActuatorSaturation "Largest torque or force of either sign"
  import SI = FESArm.Units;
  extends PartialActuator;
  parameter SI.Factor ceiling(min=1e-3, max=100) = 1 "Largest size over the reference";
equation
  y = noEvent(max(-ceiling, min(u, ceiling)));
  annotation (Documentation(info="<html>
<p>y = u, cut off at -ceiling and at ceiling. The kinks are continuous and make no events.</p>
<p>The same limit on both sides, at any speed. Source: the saturation of textbooks, for example Khalil, Nonlinear
Systems (2002), section 1.2.</p>
</html>"));
end ActuatorSaturation;
