within FESArm.Effects.Inflow;
model InflowDelay "Pure delay of the flow"
  import SI = FESArm.Units;
  extends PartialInflow;
  parameter SI.Time T(min=0, max=60) = 1 "Delay";
equation
  y = delay(u, T, 60.0);
  annotation (Documentation(info="<html>
<p>y(t) = u(t - T): the flow runs along a channel before it arrives.</p>
<p>Before t = T the first flow holds; the flow keeps its shape on its way. Derived here: plug flow along a
channel.</p>
</html>"));
end InflowDelay;
