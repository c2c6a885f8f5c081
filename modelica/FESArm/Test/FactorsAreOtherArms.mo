within FESArm.Test;
model FactorsAreOtherArms "A weak muscle is one with a smaller command, wrong moment arms are other moment arms"
  FESArm.Arms.Arm wrong(
    redeclare model MomentArm1 = FESArm.Effects.MomentArm.MomentArmError,
    redeclare model MuscleStrength1 = FESArm.Effects.MuscleStrength.MuscleWeakness,
    momentArm1(ratio={1, 1, 0.8, 1, 1, 1}),
    muscleStrength1(factor={1, 1, 1, 0.5, 1, 1}));
  FESArm.Arms.Arm other(
    d1={0.05, -0.05, 0.024, -0.03, 0, 0},
    d2={0, 0, 0.024, -0.03, -0.03, 0.03});
  output Real q1Error(unit="rad"), q2Error(unit="rad") "Zero when both arms move alike";
equation
  wrong.alpha_1 = 0.2;
  wrong.alpha_2 = 0.1;
  wrong.alpha_3 = 0.3;
  wrong.alpha_4 = 0.25;
  wrong.alpha_5 = 0.15;
  wrong.alpha_6 = 0.1;
  wrong.fx = 2;
  wrong.fy = -1;
  wrong.correction_q1 = 0;
  wrong.correction_q2 = 0;
  other.alpha_1 = 0.2;
  other.alpha_2 = 0.1;
  other.alpha_3 = 0.3;
  other.alpha_4 = 0.125;
  other.alpha_5 = 0.15;
  other.alpha_6 = 0.1;
  other.fx = 2;
  other.fy = -1;
  other.correction_q1 = 0;
  other.correction_q2 = 0;
  q1Error = wrong.q1 - other.q1;
  q2Error = wrong.q2 - other.q2;
  annotation (experiment(StopTime=1), Documentation(info="<html>
<p>The active force is alpha strength Fmax fL fV, so strength 0.5 at the command 0.25 is strength 1 at 0.125. A factor
0.8 on the moment arms d of a muscle, in torque and in length, is the arm whose d is 0.8 times as long: 0.8 * 0.03 m =
0.024 m. Both arms then obey the same equations and move alike.</p>
</html>"));
end FactorsAreOtherArms;
