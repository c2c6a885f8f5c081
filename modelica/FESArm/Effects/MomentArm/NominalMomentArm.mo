within FESArm.Effects.MomentArm;
model NominalMomentArm "Absent effect: the moment arms are the nominal ones"
  extends PartialMomentArm(present=false);
equation
  factor = ones(n);
end NominalMomentArm;
