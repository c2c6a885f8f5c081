within FESArm.Effects.MomentArm;
partial model PartialMomentArm "Contract: factor on the moment arms of each muscle"
  import SI = FESArm.Units;
  parameter Boolean present = true "False in the absent effect only";
  parameter Integer n = 6 "Number of muscles";
  output SI.Factor factor[n] "Actual over nominal moment arms";
end PartialMomentArm;
