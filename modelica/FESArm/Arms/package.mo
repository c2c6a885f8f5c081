within FESArm;
package Arms "The arm with two parameter sets"
  annotation (Documentation(info="<html><p>The same equations with the physiological set, for motion, and with the set printed in the paper, for statics.</p></html>"));
end Arms;
