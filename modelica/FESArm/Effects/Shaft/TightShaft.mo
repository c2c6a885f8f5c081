within FESArm.Effects.Shaft;
model TightShaft "Absent effect: the spring is twisted as far as the ends"
  extends PartialShaft(present=false);
equation
  stretch = twist;
  stretchRate = rate;
  annotation (Documentation(info="<html>
<p>No play: stretch = twist and stretchRate = rate.</p></html>"));
end TightShaft;
