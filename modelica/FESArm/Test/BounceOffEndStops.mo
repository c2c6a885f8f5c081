within FESArm.Test;
model BounceOffEndStops "In a stop an inertia swings like a sine, in front of it nothing holds it"
  import SI = FESArm.Units;
  parameter SI.Inertia J = 0.1 "Inertia";
  FESArm.Effects.JointTorque.EndStopAbove above(n=2, k={40, 40}, qStop={1, 1});
  FESArm.Effects.JointTorque.EndStopBelow below(n=2, k={40, 40}, qStop={-1, -1});
  SI.Angle q[2](start={1, -1}, each fixed=true) "Angles";
  SI.AngularVelocity w[2](start={2, -2}, each fixed=true) "Speeds";
  output SI.Angle aboveError, belowError "Zero when the swing is right";
  output SI.Torque freeError "Zero when the stops do not reach inwards";
equation
  der(q) = w;
  above.q = {q[1], 0.99};
  above.w = {w[1], 1};
  above.a = {0, 0};
  below.q = {q[2], -0.99};
  below.w = {w[2], -1};
  below.a = {0, 0};
  J*der(w[1]) = above.tau[1];
  J*der(w[2]) = below.tau[1];
  aboveError = q[1] - 1 - 0.1*sin(20*time);
  belowError = q[2] + 1 + 0.1*sin(20*time);
  freeError = abs(above.tau[2]) + abs(below.tau[2]);
  annotation (experiment(StopTime=0.15), Documentation(info="<html>
<p>The angular frequency is sqrt(40/0.1) = 20 rad/s; the inertia leaves the stop after pi/20 = 0.157 s.</p></html>"));
end BounceOffEndStops;
