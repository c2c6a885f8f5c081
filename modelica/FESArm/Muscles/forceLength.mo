within FESArm.Muscles;
function forceLength "Share of the largest isometric force at a fibre length"
  input Real L(unit="m") "Fibre length";
  input Real Lopt(unit="m") "Length at which the isometric force is largest";
  output Real fL(unit="1");
algorithm
  fL := exp(-((L - Lopt)/(0.65*Lopt))^2);
  annotation (Documentation(info="<html><p>Bell curve of the study's muscle model, width 0.65 of the optimum length.</p></html>"));
end forceLength;
