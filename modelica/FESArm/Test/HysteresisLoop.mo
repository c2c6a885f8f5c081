within FESArm.Test;
model HysteresisLoop "Torque of the Bouc-Wen law on the way up from rest and on the way back from the full loop"
  FESArm.Effects.JointTorque.Hysteresis up(n=1, H={0.4}, xYield=0.05, sigma=0.7);
  FESArm.Effects.JointTorque.Hysteresis back(n=1, H={0.4}, xYield=0.05, sigma=0.7, z(start={1}));
  output Real upError(unit="N.m"), backError(unit="N.m") "Zero when the law is right";
equation
  up.q = {time};
  up.w = {1};
  up.a = {0};
  back.q = {-time};
  back.w = {-1};
  back.a = {0};
  upError = up.tau[1] + 0.4*(1 - exp(-time/0.05));
  backError = back.tau[1] + 0.4*(1.4*exp(-0.4*time/0.05) - 1)/0.4;
  annotation (experiment(StopTime=0.04), Documentation(info="<html>
<p>On the way x up from z = 0: dz/dx = (1 - z)/xYield. Back from z = 1, while z stays positive:
dz/dx = (1 + (2 sigma - 1) z)/xYield.</p></html>"));
end HysteresisLoop;
