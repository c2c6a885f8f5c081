within FESArm;
package Test "Smallest models with known answers"
  annotation (Documentation(info="<html><p>Each carries its own error variable, which stays at zero up to the tolerance of the solver.</p></html>"));
end Test;
