within FESArm.Effects.JointTorque;
model EndStopAbove "Soft stop that acts above an angle"
  extends PartialEndStop(side=1);
  annotation (Documentation(info="<html>
<p>tau = -k max(0, q - qStop): a spring that only pushes back, for q &gt; qStop. Loss-free: the arm leaves the stop as
fast as it came, reversed. The force grows from zero, so speed and acceleration are continuous. Source: the piecewise
linear stop of Modelica.Mechanics.Rotational.Components.ElastoBacklash, one side, without its damping.</p>
</html>"));
end EndStopAbove;
