within FESArm.Effects.MomentArm;
model MomentArmError "The moment arms of a muscle are off by a factor"
  import SI = FESArm.Units;
  extends PartialMomentArm;
  parameter SI.Factor ratio[n](each min=0.3, each max=2) = ones(n) "Actual over nominal moment arms of each muscle";
equation
  factor = ratio;
  annotation (Documentation(info="<html>
<p>Acts on the joint torque and on the muscle's length and speed.</p>
<p>The muscle keeps its force law; its length at q = 0 stays a0. Derived here from virtual work: F dL = -tau dq with L
= a0 - ratio d q gives tau = ratio d F.</p>
</html>"));
end MomentArmError;
