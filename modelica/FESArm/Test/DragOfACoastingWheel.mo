within FESArm.Test;
model DragOfACoastingWheel "A wheel that only drag slows down has the speed w0/(1 + c w0 t/J)"
  import SI = FESArm.Units;
  parameter SI.Inertia J = 0.1 "Inertia";
  parameter SI.AngularVelocity w0 = 4 "Speed at the start, of the second wheel the other way round";
  FESArm.Effects.JointTorque.JointDrag drag(n=2, c={0.03, 0.05});
  SI.Angle q[2](each start=0, each fixed=true) "Angles";
  SI.AngularVelocity w1(start=w0, fixed=true) "Speed of the first wheel";
  SI.AngularVelocity w2(start=-w0, fixed=true) "Speed of the second wheel";
  output SI.AngularVelocity firstError, secondError "Zero when the law is right";
equation
  der(q) = {w1, w2};
  drag.q = q;
  drag.w = {w1, w2};
  drag.a = {der(w1), der(w2)};
  J*der(w1) = drag.tau[1];
  J*der(w2) = drag.tau[2];
  firstError = w1 - w0/(1 + drag.c[1]*w0*time/J);
  secondError = w2 + w0/(1 + drag.c[2]*w0*time/J);
  annotation (experiment(StopTime=2), Documentation(info="<html>
<p>J der(w) = -c w^2 for w &gt; 0 gives 1/w = 1/w0 + c t/J.</p>
</html>"));
end DragOfACoastingWheel;
