within FESArm.Muscles;
model RigidTendonMuscle "Muscle on a tendon that does not stretch"
  extends PartialHillMuscle;
equation
  Lf = L - Lslack;
  Fpassive = Kp*max(0, Lf - Lopt)^2;
  annotation (Documentation(info="<html>
<p>Lf = L - Lslack; Fpassive = Kp max(0, Lf - Lopt)^2.</p>
<p>Assumptions: the tendon keeps its slack length, so the fibre takes up the whole change of length; passive force only
beyond the optimum length. Used wherever the arm moves. Source: Zajac, Muscle and tendon, Critical Reviews in Biomedical
Engineering 17 (1989), for the stiff tendon.</p>
</html>"));
end RigidTendonMuscle;
