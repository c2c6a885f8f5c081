within FESArm.Effects.Force;
model LinearDrag "Drag of a sliding body, growing with the square of speed"
  import SI = FESArm.Units;
  extends PartialForce;
  parameter SI.QuadraticDrag c[n](each min=0) = fill(0.1, n) "Drag";
equation
  for i in 1:n loop
    f[i] = -c[i]*abs(v[i])*v[i];
  end for;
  annotation (Documentation(info="<html>
<p>f = -c |v| v. Dissipates for c &gt; 0; its slope is continuous through rest.</p>
<p>A body in a wide stream at large Reynolds numbers, c = rho Cd A/2. Source: Batchelor, An Introduction to Fluid
Dynamics (1967), chapter 5.</p>
</html>"));
end LinearDrag;
