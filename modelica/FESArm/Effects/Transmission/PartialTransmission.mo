within FESArm.Effects.Transmission;
partial model PartialTransmission "Contract: inertia that moves with the motor, and torque of the rest on it"
  import SI = FESArm.Units;
  parameter Boolean present = true "False in the absent effect only";
  input SI.Inertia J "Inertia of motor and load together";
  input SI.AngularAcceleration a "Acceleration of the motor";
  output SI.Inertia JMotor "Inertia that moves with the motor";
  output SI.Torque tau "Torque of the rest on the motor, positive in the direction of its angle";
  annotation (Documentation(info="<html>
<p>JMotor a = torques on the motor + tau. Motor and encoder share an angle, and torques of other effects act there.
Contract of this project.</p>
</html>"));
end PartialTransmission;
