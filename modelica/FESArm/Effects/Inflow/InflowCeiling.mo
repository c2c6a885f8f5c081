within FESArm.Effects.Inflow;
model InflowCeiling "Largest flow of a pump"
  import SI = FESArm.Units;
  extends PartialInflow;
  parameter SI.VolumeFlowRate ceiling(min=1e-12) = 2e-4 "Largest flow";
equation
  y = noEvent(min(u, ceiling));
  annotation (Documentation(info="<html>
<p>y = min(u, ceiling). The kink is continuous and makes no event.</p>
<p>The pump follows at once below its limit. Derived here: the largest flow of a pump at constant pressure.</p>
</html>"));
end InflowCeiling;
