within FESArm.Effects.Tendon;
partial model PartialTendon "Contract: force on the bones from the path of each muscle and its activation"
  import SI = FESArm.Units;
  parameter Boolean present = true "False in the absent effect only";
  parameter Integer n = 6 "Number of muscles";
  parameter SI.Force Fmax[n] = fill(800, n) "Largest isometric forces";
  parameter SI.Length Lslack[n] = fill(0.0538, n) "Slack lengths of the tendons";
  parameter SI.Length Lopt[n] = fill(0.1280, n) "Optimum fibre lengths";
  parameter SI.Velocity Vmax[n] = fill(1.280, n) "Largest shortening speeds";
  parameter SI.QuadraticStiffness Kp = 7500 "Stiffness of the passive forces";
  input SI.Fraction active[n] "Activations times strengths";
  input SI.Length L[n] "Lengths of muscle and tendon";
  input SI.Velocity V[n] "= der(L)";
  input SI.Force Frigid[n] "Forces of the muscles at the lengths and speeds below";
  output SI.Length Lfree[n] "Lengths of muscle and tendon without the tendon's stretch";
  output SI.Velocity Vfree[n] "= der(Lfree)";
  output SI.Force F[n] "Forces on the bones, positive when the muscles pull";
  annotation (Documentation(info="<html>
<p>A tendon stands in series with its muscle: it gives the muscle the length and the speed that its stretch leaves, and the
bones its force. The parameters are those of the muscles, since the speed of a fibre on an elastic tendon follows from
its own law. Activations and strengths come as one product.</p></html>"));
end PartialTendon;
