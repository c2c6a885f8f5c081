within FESArm.Effects;
package StimulationPath "From commanded to actual activation"
  annotation (Documentation(info="<html><p>Laws between the commanded and the actual activation. Slots in series: 1 delay, 2 static maps, 3 lag.</p></html>"));
end StimulationPath;
