within FESArm.Test;
model CartKeepsEnergyAndMomentum "Without a force, cart and pole keep their energy and their momentum along the rail"
  FESArm.Plants.Cart cart(q(start=1.0), v(start=0.2));
  output Real energyError(unit="J") "Zero when the motion is right";
  output Real momentumError(unit="N.s") "Zero when the motion is right";
protected
  FESArm.Units.Velocity vx, vy "Velocity of the pole's centre of mass";
equation
  cart.force = 0;
  cart.correction_x = 0;
  cart.correction_theta = 0;
  vx = cart.v + cart.l*cos(cart.q)*cart.w;
  vy = -cart.l*sin(cart.q)*cart.w;
  energyError = cart.M*(cart.v^2 - 0.2^2)/2 + cart.m*(vx^2 + vy^2 - 0.2^2)/2 + cart.I*cart.w^2/2
    + cart.m*cart.g*cart.l*(cos(cart.q) - cos(1.0));
  momentumError = cart.M*cart.v + cart.m*vx - (cart.M + cart.m)*0.2;
  annotation (experiment(StopTime=5), Documentation(info="<html>
<p>No force along the rail: the momentum M v + m vx is constant. No friction: the energy M v^2/2 + m (vx^2 + vy^2)/2 +
I w^2/2 + m g l cos(theta) is constant. (vx, vy) is the derivative of the position (x + l sin(theta), l cos(theta)) of
the pole's centre of mass. Start: v = 0.2 m/s, w = 0, theta = 1 rad.</p>
</html>"));
end CartKeepsEnergyAndMomentum;
