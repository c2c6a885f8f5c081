within FESArm.Effects.Transmission;
model RigidTransmission "Absent effect: motor and load move as one"
  extends PartialTransmission(present=false);
equation
  JMotor = J;
  tau = 0;
  annotation (Documentation(info="<html><p>JMotor = J and tau = 0.</p></html>"));
end RigidTransmission;
