within FESArm.Effects.JointTorque;
model EndStopBelow "Soft stop that acts below an angle"
  extends PartialEndStop(side=-1);
  annotation (Documentation(info="<html>
<p>tau = k max(0, qStop - q): the mirror image of <code>EndStopAbove</code>, with the same assumptions and source, for
q &lt; qStop.</p>
</html>"));
end EndStopBelow;
