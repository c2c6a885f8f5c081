within FESArm.Test;
model BacklashKeepsItsEnergy "A shaft with play passes torque in contact only, and keeps the energy that goes into it"
  FESArm.Plants.TwoMassDrive drive(
    redeclare model Shaft1 = FESArm.Effects.Shaft.Backlash,
    shaft1(gap=0.02, onset=0.001),
    d=0,
    wMotor(start=0.5));
  FESArm.Effects.Shaft.Backlash up(gap=0.02), down(gap=0.02), middle(gap=0.02), none(gap=0);
  output Real energyError(unit="J") "Zero when the shaft keeps its energy";
  output Real contactError(unit="rad") "Zero when the stretch is the twist beyond the play";
  output Real rateError(unit="rad/s") "Zero when the rate is that of the stretch";
protected
  Real x(unit="rad"), above(unit="rad"), below(unit="rad") "Twist, and distances from the edges of the play";
  Real potential(unit="rad2") "Integral of the stretch over the twist";
equation
  drive.torque = 0;
  drive.correction_phiMotor = 0;
  drive.correction_phiLoad = 0;
  x = drive.phiMotor - drive.phiLoad;
  above = sqrt((x - 0.01)^2 + 1e-6);
  below = sqrt((x + 0.01)^2 + 1e-6);
  potential = x^2/2 + ((x - 0.01)*above - (x + 0.01)*below)/4 + 0.25e-6*log((x - 0.01 + above)/(x + 0.01 + below))
    + 0.01*sqrt(1.01e-4)/2 - 0.25e-6*log((sqrt(1.01e-4) - 0.01)/(sqrt(1.01e-4) + 0.01));
  energyError = drive.JMotor*drive.wMotor^2/2 + drive.JLoad*drive.wLoad^2/2 + drive.k*potential - 0.002*0.5^2/2;
  up.twist = 1 + time;
  up.rate = 1;
  down.twist = -1 - time;
  down.rate = -1;
  middle.twist = 0;
  middle.rate = 1;
  none.twist = time;
  none.rate = 1;
  contactError = abs(up.stretch - time - 0.99) + abs(down.stretch + time + 0.99) + abs(middle.stretch)
    + abs(none.stretch - time);
  rateError = abs(up.stretchRate - 1) + abs(down.stretchRate + 1) + abs(none.stretchRate - 1)
    + abs(middle.stretchRate - (1 - 0.01/sqrt(1e-4 + 4e-10)));
  annotation (experiment(StopTime=1), Documentation(info="<html>
<p>Far from the edges the rounding is below onset^2. In the rounded dead zone the integral of sqrt(x^2 + onset^2) is
(x sqrt(x^2 + onset^2) + onset^2 asinh(x/onset))/2, of which two make the potential energy.</p></html>"));
end BacklashKeepsItsEnergy;
