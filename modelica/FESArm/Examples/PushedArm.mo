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
  annotation (experiment(StopTime=5));
end PushedArm;
