within FESArm.Test;
model FreeShaft "A twisted free shaft swings like a cosine about a common speed that never changes"
  FESArm.Plants.TwoMassDrive drive(
    d=0,
    phiMotor(start=0.1),
    wMotor(start=2),
    wLoad(start=2));
  output Real twistError(unit="rad") "Zero when the beat of the shaft is right";
  output Real momentumError(unit="N.m.s") "Zero when the angular momentum is kept";
protected
  Real omega(unit="rad/s") "Angular frequency of the twist";
equation
  drive.torque = 0;
  drive.correction_phiMotor = 0;
  drive.correction_phiLoad = 0;
  omega = sqrt(drive.k*(1/drive.JMotor + 1/drive.JLoad));
  twistError = drive.phiMotor - drive.phiLoad - 0.1*cos(omega*time);
  momentumError = drive.JMotor*(drive.wMotor - 2) + drive.JLoad*(drive.wLoad - 2);
  annotation (experiment(StopTime=1));
end FreeShaft;
