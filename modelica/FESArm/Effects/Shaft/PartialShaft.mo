within FESArm.Effects.Shaft;
partial model PartialShaft "Contract: stretch of a shaft's spring from the twist between its ends"
  import SI = FESArm.Units;
  parameter Boolean present = true "False in the absent effect only";
  input SI.Angle twist "Angle of the driving end minus that of the driven end";
  input SI.AngularVelocity rate "= der(twist)";
  output SI.Angle stretch "Twist of the spring; its torque is stiffness times this";
  output SI.AngularVelocity stretchRate "= der(stretch); the damper's torque is damping times this";
  annotation (Documentation(info="<html>
<p>The plant has the stiffness and the damping; a law of this contract says which part of the twist they act on.
Angles count positive in the direction of the driving end.</p></html>"));
end PartialShaft;
