within FESArm.Effects.StimulationPath;
model Saturation "Ceiling of the activation"
  import SI = FESArm.Units;
  extends PartialStimulationPath;
  parameter SI.Factor ceiling(min=0.05, max=1) = 0.8 "Largest activation";
equation
  for i in 1:n loop
    y[i] = noEvent(min(u[i], ceiling));
  end for;
  annotation (Documentation(info="<html>
<p>y = min(u, ceiling).</p>
<p>Static, the same for every channel; below the ceiling nothing changes. Derived here: the upper half of
<code>RecruitmentCurve</code>.</p>
</html>"));
end Saturation;
