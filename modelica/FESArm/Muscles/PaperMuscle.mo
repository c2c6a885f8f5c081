within FESArm.Muscles;
model PaperMuscle "Muscle as the study's paper prints it"
  extends PartialHillMuscle;
equation
  Lf = L;
  Fpassive = Kp*(L - Lslack)^2;
  annotation (Documentation(info="<html>
<p>Lf = L; Fpassive = Kp (L - Lslack)^2. Source: the equations and the table of the study.</p>
<p>The whole length counts as fibre length and the passive force acts on both sides of the slack length. Only this
reading gives the largest endpoint forces that the paper states; it serves the static study.</p>
</html>"));
end PaperMuscle;
