within FESArm.Effects;
package ForceSensor "Errors of the force sensor"
  annotation (Documentation(info="<html><p>The true force behind a reading.</p></html>"));
end ForceSensor;
