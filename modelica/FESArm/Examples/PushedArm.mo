within FESArm.Examples;
model PushedArm "A steady push against the arm: look at arm.q1 and arm.q2 settle"
  FESArm.Arms.Arm arm;
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
<p>M(q) a + h(q, w) + b w = torques of the muscles + J(q)' f with constant activations and a push f = (2 N, 0). Both
joints come to rest where these torques balance; the antagonists' force-length curves make the arm stiff enough for
that. Arm, data and assumptions are those of <code>FESArm.Arms.Arm</code>.</p>
</html>"));
end PushedArm;
