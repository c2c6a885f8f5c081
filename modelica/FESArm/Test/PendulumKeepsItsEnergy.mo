within FESArm.Test;
model PendulumKeepsItsEnergy "Without friction, kinetic and potential energy add up to what they were"
  FESArm.Plants.Pendulum pendulum(q(start=0.5));
  output Real energyError(unit="J") "Zero when the motion is right";
equation
  pendulum.correction_theta = 0;
  energyError = (pendulum.I + pendulum.m*pendulum.a^2)*pendulum.w^2/2
    + pendulum.m*pendulum.g*pendulum.a*(cos(pendulum.q) - cos(0.5));
  annotation (experiment(StopTime=5), Documentation(info="<html>
<p>Without friction E = (I + m a^2) w^2/2 + m g a cos(theta) is constant; it starts at rest at theta = 0.5 rad.
Derived from the equation of motion times w: w ((I + m a^2) der(w) - m g a sin(theta)) = dE/dt = 0.</p>
</html>"));
end PendulumKeepsItsEnergy;
