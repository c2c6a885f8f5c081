within FESArm.Effects.ForceSensor;
partial model PartialForceSensor "Contract: true force at the wrist behind the measured one"
  import SI = FESArm.Units;
  parameter Boolean present = true "False in the absent effect only";
  input SI.Force u[2] "Measured force, world axes";
  output SI.Force f[2] "True force, world axes";
end PartialForceSensor;
