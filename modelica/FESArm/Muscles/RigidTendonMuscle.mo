within FESArm.Muscles;
model RigidTendonMuscle "Muscle on a tendon that does not stretch"
  extends PartialHillMuscle;
equation
  Lf = L - Lslack;
  Fpassive = Kp*max(0, Lf - Lopt)^2;
  annotation (Documentation(info="<html><p>Used wherever the arm moves. Passive force only beyond the optimum length.</p></html>"));
end RigidTendonMuscle;
