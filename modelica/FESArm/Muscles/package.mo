within FESArm;
package Muscles "Hill muscles"
  annotation (Documentation(info="<html><p>Muscle force as a function of activation, length and speed. Laws and constants are those of the study's table.</p></html>"));
end Muscles;
