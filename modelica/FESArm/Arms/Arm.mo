within FESArm.Arms;
model Arm "The arm with the physiological parameter set"
  extends PartialArm(
    d1 = {0.05, -0.05, 0.03, -0.03, 0, 0},
    d2 = {0, 0, 0.03, -0.03, -0.03, 0.03});
  annotation (Documentation(info="<html><p>Extensors have negative moment arms and the tendons are rigid. All moving trials use this set.</p></html>"));
end Arm;
