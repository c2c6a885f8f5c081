within FESArm.Muscles;
model MuscleAlone "One muscle, driven by activation, length and speed"
  import SI = FESArm.Units;
  parameter SI.Force Fmax = 800 "Largest isometric force";
  parameter SI.Length Lslack = 0.0538 "Slack length of the tendon";
  parameter SI.Length Lopt = 0.1280 "Fibre length of the largest isometric force";
  parameter SI.Velocity Vmax = 1.280 "Largest shortening speed";
  parameter SI.QuadraticStiffness Kp = 7500 "Stiffness of the passive force";
  input SI.Fraction alpha(start=0) "Activation";
  input SI.Length L(start=0.18) "Length of muscle and tendon";
  input SI.Velocity V(start=0) "= der(L)";
  output SI.Force F "Force, positive when the muscle pulls";
  RigidTendonMuscle law(Fmax=Fmax, Lslack=Lslack, Lopt=Lopt, Vmax=Vmax, Kp=Kp);
equation
  law.alpha = alpha;
  law.strength = 1;
  law.L = L;
  law.V = V;
  F = law.F;
  annotation (Documentation(info="<html>
<p>F = alpha Fmax fL(Lf) fV(V) + Kp max(0, Lf - Lopt)^2 with Lf = L - Lslack: <code>RigidTendonMuscle</code> by itself, for
co-simulation with <code>Arms.ArmWithoutMuscles</code>. It has no state: the force follows activation, length and speed at
once.</p>
<p>Assumptions and source: those of <code>RigidTendonMuscle</code> (Zajac 1989); data are the study's table, for the first
muscle by default.</p>
</html>"));
end MuscleAlone;
