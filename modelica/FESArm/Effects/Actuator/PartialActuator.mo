within FESArm.Effects.Actuator;
partial model PartialActuator "Contract: from the command of a motor to what it delivers"
  import SI = FESArm.Units;
  parameter Boolean present = true "False in the absent effect only";
  input SI.Factor u "Command over a reference";
  output SI.Factor y "Delivered over the same reference";
  annotation (Documentation(info="<html><p>A law gives what a drive delivers from what was commanded, both over the plant's reference.</p></html>"));
end PartialActuator;
