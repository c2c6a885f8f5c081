within FESArm.Plants;
model LinearDrive "Mass driven by a force along a slide"
  import SI = FESArm.Units;
  import FESArm.Effects.Force;
  import FESArm.Effects.LengthSensor;
  import FESArm.Effects.Actuator;
  parameter SI.Mass m = 1.5 "Moving mass";
  constant SI.Force fRef = 1 "Reference of the actuator's command";
  input SI.Force force(start=0) "Force of the motor";
  input SI.Force correction_x(start=0) "Force beside the model's own";
  output SI.Length x "Reading of the position";
  SI.Length s(start=0, fixed=true) "Position";
  SI.Velocity v(start=0, fixed=true) "= der(s)";
  replaceable model Force1 = Force.NoForce constrainedby Force.PartialForce;
  Force1 force1(n=1);
  replaceable model Force2 = Force.NoForce constrainedby Force.PartialForce;
  Force2 force2(n=1);
  replaceable model Force3 = Force.NoForce constrainedby Force.PartialForce;
  Force3 force3(n=1);
  replaceable model LengthSensor1 = LengthSensor.TrueLengthSensor constrainedby LengthSensor.PartialLengthSensor;
  LengthSensor1 lengthSensor1(n=1);
  replaceable model LengthSensor2 = LengthSensor.TrueLengthSensor constrainedby LengthSensor.PartialLengthSensor;
  LengthSensor2 lengthSensor2(n=1);
  replaceable model Actuator1 = Actuator.IdealActuator constrainedby Actuator.PartialActuator;
  Actuator1 actuator1;
  replaceable model Actuator2 = Actuator.IdealActuator constrainedby Actuator.PartialActuator;
  Actuator2 actuator2;
protected
  SI.Acceleration vdot "= der(v)";
equation
  force1.x = {s};
  force1.v = {v};
  force1.a = {vdot};
  force2.x = {s};
  force2.v = {v};
  force2.a = {vdot};
  force3.x = {s};
  force3.v = {v};
  force3.a = {vdot};
  lengthSensor1.x = {s};
  lengthSensor2.x = lengthSensor1.y;
  x = lengthSensor2.y[1];
  actuator1.u = force/fRef;
  actuator2.u = actuator1.y;
  der(s) = v;
  der(v) = vdot;
  m*vdot = fRef*actuator2.y + force1.f[1] + force2.f[1] + force3.f[1] + correction_x;
  annotation (Documentation(info="<html>
<p>m der(v) = force + forces of the effects: one degree of freedom, a mass under a force on a level slide without friction.
Friction, drag, and errors of motor and sensor are effects in the slots. The mass is that of a small linear axis, chosen
for this project.</p>
</html>"));
end LinearDrive;
