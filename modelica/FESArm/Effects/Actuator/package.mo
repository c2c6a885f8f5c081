within FESArm.Effects;
package Actuator "Errors of a motor or a linear drive"
  annotation (Documentation(info="<html><p>What a drive delivers against its command, both over the reference that the plant declares.</p></html>"));
end Actuator;
