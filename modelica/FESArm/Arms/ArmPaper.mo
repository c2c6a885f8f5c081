within FESArm.Arms;
model ArmPaper "The arm with the parameter set as the study's paper prints it"
  extends PartialArm(
    redeclare FESArm.Muscles.PaperMuscle muscle[6](Fmax=Fmax, Lslack=Lslack, Lopt=Lopt, Vmax=Vmax, each Kp=Kp),
    d1 = {0.05, 0.05, 0.03, 0.03, 0, 0},
    d2 = {0, 0, 0.03, 0.03, 0.03, 0.03});
  annotation (Documentation(info="<html><p>All moment arms positive, as printed. The static study uses this set.</p></html>"));
end ArmPaper;
