within FESArm.Test;
model PendulumSmallSwing "A pendulum swings like a cosine if it hardly swings"
  FESArm.Plants.Pendulum pendulum(q(start=3.14159265358979323846 + 1e-3));
  output Real thetaError(unit="rad") "Zero when the period is right";
protected
  Real omega(unit="rad/s") "Angular frequency of small swings";
equation
  pendulum.correction_theta = 0;
  omega = sqrt(pendulum.m*pendulum.g*pendulum.a/(pendulum.I + pendulum.m*pendulum.a^2));
  thetaError = pendulum.theta - 3.14159265358979323846 - 1e-3*cos(omega*time);
  annotation (experiment(StopTime=2), Documentation(info="<html>
<p>theta - pi = A cos(omega t) with omega^2 = m g a/(I + m a^2); a swing of A = 1e-3 rad is slower by A^2/16 of itself, which
shifts the angle by 1e-9 rad.</p></html>"));
end PendulumSmallSwing;
