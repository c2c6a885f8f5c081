within FESArm.Effects.WristLoad;
model ConstantForce "Steady force at the wrist"
  import SI = FESArm.Units;
  extends PartialWristLoad;
  parameter SI.Force f0[2] = {0.1, 0.1} "Force on the arm, world axes";
equation
  f = f0;
  annotation (Documentation(info="<html>
<p>f = f0.</p>
<p>Neither position nor motion matters. Derived here: the simplest force at the wrist, such as a string over a
pulley.</p>
</html>"));
end ConstantForce;
