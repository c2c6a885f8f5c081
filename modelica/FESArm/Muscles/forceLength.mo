within FESArm.Muscles;
function forceLength "Share of the largest isometric force at a fibre length"
  input Real L(unit="m") "Fibre length";
  input Real Lopt(unit="m") "Length at which the isometric force is largest";
  output Real fL(unit="1");
algorithm
  fL := exp(-((L - Lopt)/(0.65*Lopt))^2);
  annotation (Documentation(info="<html>
<p>fL = exp(-((L - Lopt)/(0.65 Lopt))^2), the bell curve of the study's muscle model. Assumption: the same shape at every
activation.</p>
</html>"));
end forceLength;
