within FESArm.Effects;
package Transmission "Path from a motor to its load"
  annotation (Documentation(info="<html><p>What the inertia behind a motor does to it, as the encoder on the motor shows it.</p></html>"));
end Transmission;
