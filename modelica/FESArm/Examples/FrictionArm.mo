within FESArm.Examples;
model FrictionArm "The pushed arm with friction added: look at how much slower arm.q2 moves"
  extends PushedArm(arm(
    redeclare FESArm.Effects.JointTorque.ViscousFriction jointTorque1(b={0.5, 0.5}),
    redeclare FESArm.Effects.JointTorque.CoulombFriction jointTorque2(tauC={0.2, 0.2})));
  annotation (experiment(StopTime=5));
end FrictionArm;
