within FESArm.Effects.Transmission;
model JointElasticity "Motor and load as two masses on a spring"
  import SI = FESArm.Units;
  extends PartialTransmission;
  parameter SI.RotationalStiffness k(min=1e-9) = 100 "Stiffness between motor and load";
  parameter SI.RotationalDamping d(min=0) = 0.02 "Damping between motor and load";
  parameter SI.Factor share(min=0.1, max=0.9) = 0.5 "Share of the inertia that the motor has";
  SI.Angle twist(start=0, fixed=true, min=-3, max=3) "Angle of the motor minus that of the load";
  SI.AngularVelocity rate(start=0, fixed=true, min=-2000, max=2000) "= der(twist)";
equation
  JMotor = share*J;
  tau = -k*twist - d*rate;
  der(twist) = rate;
  der(rate) = a + tau/((1 - share)*J);
  annotation (Documentation(info="<html>
<p>share J a = torques on the motor + tau and (1 - share) J (a - der(rate)) = -tau with tau = -k twist - d rate: two masses on
a spring and a damper, both linear, of the inertia that the rigid drive has. The encoder sits on the motor, so the motion
of the load shows by its torque only; at rest nothing shows. The highest k keeps the resonance of a small drive
where a step of 4 ms follows it; with the lowest its motor and load swing once in several seconds, by some radians.
Source: two-mass model of a flexible joint, Spong, Modeling and control of
elastic joint robots, ASME Journal of Dynamic Systems, Measurement, and Control 109 (1987).</p></html>"));
end JointElasticity;
