within FESArm.Test;
model FreeShaft "A twisted free shaft swings like a cosine about a common speed that never changes"
  FESArm.Plants.TwoMassDrive drive(
    d=0,
    qMotor(start=0.1),
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
  annotation (experiment(StopTime=1), Documentation(info="<html>
<p>JMotor der(wMotor) = -k twist and JLoad der(wLoad) = k twist. Their sum is zero: the angular momentum is constant.
Divided by the inertias and subtracted: der(der(twist)) = -k (1/JMotor + 1/JLoad) twist, from rest at 0.1 rad twist =
0.1 cos(omega t).</p>
</html>"));
end FreeShaft;
