within FESArm.Examples;
model FrictionArm "The pushed arm with friction added: look at how much slower arm.q2 moves"
  FESArm.Arms.Arm arm(
    redeclare model JointTorque1 = FESArm.Effects.JointTorque.ViscousFriction,
    jointTorque1(b={0.5, 0.5}),
    redeclare model JointTorque2 = FESArm.Effects.JointTorque.CoulombFriction,
    jointTorque2(tauC={0.2, 0.2}));
equation
  arm.alpha_1 = 0.2;
  arm.alpha_2 = 0.2;
  arm.alpha_3 = 0.1;
  arm.alpha_4 = 0.1;
  arm.alpha_5 = 0.1;
  arm.alpha_6 = 0.1;
  arm.fx = 2;
  arm.fy = 0;
  arm.correction_q1 = 0;
  arm.correction_q2 = 0;
  annotation (experiment(StopTime=5), Documentation(info="<html>
<p><code>PushedArm</code> with -b w and -tauC tanh(w/wSharp) added at both joints, b = 0.5 N.m.s/rad and tauC = 0.2
N.m, each in a slot of its own: torques of slots add. Equations, assumptions and sources stand in
<code>ViscousFriction</code> and <code>CoulombFriction</code>. The values are chosen for this example, so that the
friction is plain to see.</p>
</html>"));
end FrictionArm;
