within FESArm.Effects.WristLoad;
model QuadraticDrag "Force against the motion, growing with the square of speed"
  import SI = FESArm.Units;
  extends PartialWristLoad;
  parameter SI.QuadraticDrag c(min=0) = 0.2 "Drag coefficient";
equation
  f = -c*sqrt(v*v + 1e-12)*v;
  annotation (Documentation(info="<html>
<p>f = -c |v| v; the speed is rounded off below 1e-6 m/s.</p>
<p>Against the velocity, the same in all directions; only the wrist is in the stream, not the links. Source: drag at
large Reynolds numbers, c = rho Cd A/2 (Batchelor, An Introduction to Fluid Dynamics, 1967, chapter 5).</p>
</html>"));
end QuadraticDrag;
