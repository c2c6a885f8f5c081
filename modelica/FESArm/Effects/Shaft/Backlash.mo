within FESArm.Effects.Shaft;
model Backlash "Play between the ends of the shaft"
  import SI = FESArm.Units;
  extends PartialShaft;
  parameter SI.Angle gap(min=0, max=6.3) = 0.01 "Whole play, from contact on one side to contact on the other";
  parameter SI.Angle onset(min=1e-6, max=0.01) = 2e-5 "Angle over which contact sets in";
protected
  SI.Angle above, below "Distances from the edges of the play, smooth at the edge";
equation
  above = sqrt((twist - gap/2)^2 + onset^2);
  below = sqrt((twist + gap/2)^2 + onset^2);
  stretch = twist + (above - below)/2;
  stretchRate = rate*(1 + ((twist - gap/2)/above - (twist + gap/2)/below)/2);
  annotation (Documentation(info="<html>
<p>A dead zone: stretch = 0 while |twist| &lt; gap/2, and stretch = twist - gap/2 or twist + gap/2 beyond, with spring
and damper acting in contact only. The corners are rounded, |x| read as sqrt(x^2 + onset^2), so the stretch is too
large by onset/2 at an edge and by less than onset^2/(4 x) at the distance x from it; a play of zero is exactly the
tight shaft. The contact does not stick and the play holds no oil. Source: dead-zone model of Nordin and Gutman,
Controlling mechanical systems with backlash, Automatica 38 (2002).</p>
</html>"));
end Backlash;
