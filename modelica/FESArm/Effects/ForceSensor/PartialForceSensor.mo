within FESArm.Effects.ForceSensor;
partial model PartialForceSensor "Contract: true force at the wrist behind the measured one"
  import SI = FESArm.Units;
  parameter Boolean present = true "False in the absent effect only";
  input SI.Force u[2] "Measured force, world axes";
  output SI.Force f[2] "True force, world axes";
  annotation (Documentation(info="<html>
<p>The model's input is the reading u, the arm feels the force f behind it: an effect states f = F(u), the inverse of
the sensor's characteristic reading = F<sup>-1</sup>(f), which has to be invertible. Static: no lag and no noise.
Contract of this project.</p>
</html>"));
end PartialForceSensor;
