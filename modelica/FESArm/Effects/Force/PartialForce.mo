within FESArm.Effects.Force;
partial model PartialForce "Contract: force along a straight line from the motion along it"
  import SI = FESArm.Units;
  parameter Boolean present = true "False in the absent effect only";
  parameter Integer n = 1 "Number of sliding bodies";
  input SI.Length x[n] "Positions";
  input SI.Velocity v[n] "= der(x)";
  input SI.Acceleration a[n] "= der(v)";
  output SI.Force f[n] "Force on the body, positive in the direction of x";
  annotation (Documentation(info="<html><p>A law gives forces f(x, v, a) along the lines; they are added to the model's own forces. Positive in the direction of x.</p></html>"));
end PartialForce;
