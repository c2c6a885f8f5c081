within FESArm.Effects;
package JointSensor "Errors of the encoders"
  annotation (Documentation(info="<html><p>What an encoder reads against the true angle.</p></html>"));
end JointSensor;
