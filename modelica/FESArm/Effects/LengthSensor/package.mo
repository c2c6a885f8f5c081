within FESArm.Effects;
package LengthSensor "Errors of sensors of position and level"
  annotation (Documentation(info="<html><p>What a sensor of a length reads against the truth.</p></html>"));
end LengthSensor;
