within FESArm.Test;
model PayloadAcceleration "A carried mass slows a pushed body as if it were part of it"
  import SI = FESArm.Units;
  parameter SI.Mass body = 2 "Mass of the body";
  parameter SI.Force push = 3 "Constant push along x";
  FESArm.Effects.WristLoad.Payload payload(mass=0.5);
  SI.Length x(start=0, fixed=true) "Position";
  SI.Velocity v(start=0, fixed=true) "= der(x)";
  SI.Acceleration a "= der(v)";
  output SI.Length xError "Zero when the law is right";
equation
  der(x) = v;
  der(v) = a;
  payload.r = {x, 0};
  payload.v = {v, 0};
  payload.vdot = {a, 0};
  body*a = push + payload.f[1];
  xError = x - push/(body + payload.mass)*time^2/2;
  annotation (experiment(StopTime=2), Documentation(info="<html>
<p>body a = push - mass a, so that a = push/(body + mass) and, from rest, x = a t^2/2.</p>
</html>"));
end PayloadAcceleration;
