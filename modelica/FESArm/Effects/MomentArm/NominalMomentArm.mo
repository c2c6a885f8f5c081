within FESArm.Effects.MomentArm;
model NominalMomentArm "Absent effect: the moment arms are the nominal ones"
  extends PartialMomentArm(present=false);
equation
  factor = ones(n);
  annotation (Documentation(info="<html><p>factor = 1 for every muscle.</p></html>"));
end NominalMomentArm;
