within FESArm.Muscles;
partial model PartialHillMuscle "Contract of a muscle: force from activation, length and speed"
  import SI = FESArm.Units;
  parameter SI.Force Fmax = 800 "Largest isometric force";
  parameter SI.Length Lslack = 0.0538 "Slack length of the tendon";
  parameter SI.Length Lopt = 0.1280 "Fibre length of the largest isometric force";
  parameter SI.Velocity Vmax = 1.280 "Largest shortening speed";
  parameter SI.QuadraticStiffness Kp = 7500 "Stiffness of the passive force";
  input SI.Fraction alpha "Activation";
  input SI.Factor strength "Factor on the active force";
  input SI.Length L "Length of muscle and tendon";
  input SI.Velocity V "= der(L)";
  output SI.Force F "Force, positive when the muscle pulls";
protected
  SI.Length Lf "Fibre length";
  SI.Force Fpassive "Force without activation";
equation
  F = alpha*strength*Fmax*forceLength(Lf, Lopt)*forceVelocity(V, Vmax) + Fpassive;
  annotation (Documentation(info="<html>
<p>F = alpha strength Fmax fL(Lf) fV(V) + Fpassive(Lf): Hill's muscle (Hill 1938, Proceedings of the Royal Society B
126, 136-195) in the product form of Zajac 1989 (Critical Reviews in Biomedical Engineering 17, 359-411). Activation,
length and speed act independently of one another, there is no pennation, and the fibre's speed is that of the whole
muscle: the tendon does not stretch. A law states the fibre length Lf and the passive force. Data are the study's
table.</p>
</html>"));
end PartialHillMuscle;
