within FESArm.Effects.WristLoad;
partial model PartialWristLoad "Contract: force at the wrist from its motion"
  import SI = FESArm.Units;
  parameter Boolean present = true "False in the absent effect only";
  input SI.Length r[2] "Position of the wrist, world axes";
  input SI.Velocity v[2] "= der(r)";
  input SI.Acceleration vdot[2] "= der(v)";
  output SI.Force f[2] "Force on the arm, world axes";
end PartialWristLoad;
