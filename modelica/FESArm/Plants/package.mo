within FESArm;
package Plants "Machines beyond the arm"
  annotation (Documentation(info="<html><p>Small plants with the arm's conventions: slots for effects, and correction inputs beside the model's own forces.</p></html>"));
end Plants;
