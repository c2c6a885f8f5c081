within FESArm.Effects.MomentArm;
partial model PartialMomentArm "Contract: factor on the moment arms of each muscle"
  import SI = FESArm.Units;
  parameter Boolean present = true "False in the absent effect only";
  parameter Integer n = 6 "Number of muscles";
  output SI.Factor factor[n] "Actual over nominal moment arms";
  annotation (Documentation(info="<html>
<p>The moment arms about both joints become factor d, in the torque (factor d F) and in the length (L = a0 - factor d
q) alike. Both places need the same factor: the torque is -dL/dq F by virtual work (An, Takahashi, Harrigan, Chao
1984, Journal of Biomechanical Engineering 106, 280-282), so that the muscle's work F dL is what the joints receive.
The factor does not depend on posture.</p>
</html>"));
end PartialMomentArm;
