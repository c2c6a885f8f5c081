within FESArm.Test;
model PendulumKeepsItsEnergy "Without friction, kinetic and potential energy add up to what they were"
  FESArm.Plants.Pendulum pendulum(theta(start=0.5));
  output Real energyError(unit="J") "Zero when the motion is right";
equation
  pendulum.correction_theta = 0;
  energyError = (pendulum.I + pendulum.m*pendulum.a^2)*pendulum.w^2/2
    + pendulum.m*pendulum.g*pendulum.a*(cos(pendulum.theta) - cos(0.5));
  annotation (experiment(StopTime=5));
end PendulumKeepsItsEnergy;
