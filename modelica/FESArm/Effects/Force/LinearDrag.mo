within FESArm.Effects.Force;
model LinearDrag "Drag of a sliding body, growing with the square of speed"
  import SI = FESArm.Units;
  extends PartialForce;
  parameter SI.QuadraticDrag c[n](each min=0, each max=100) = fill(0.1, n) "Drag";
equation
  for i in 1:n loop
    f[i] = -c[i]*abs(v[i])*v[i];
  end for;
  annotation (Documentation(info="<html>
<p>f = -c |v| v. Dissipates for c &gt; 0; its slope is continuous through rest.</p></html>"));
end LinearDrag;
