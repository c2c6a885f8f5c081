within FESArm.Effects.LengthSensor;
partial model PartialLengthSensor "Contract: reading of sensors of a length"
  import SI = FESArm.Units;
  parameter Boolean present = true "False in the absent effect only";
  parameter Integer n = 1 "Number of sensors";
  input SI.Length x[n] "True lengths";
  output SI.Length y[n] "Readings";
  annotation (Documentation(info="<html><p>A law gives readings y from the true lengths x. Motion and flows are those of the truth; only what is recorded differs.</p></html>"));
end PartialLengthSensor;
