within FESArm.Test;
model NoEffectIsTheSamePlant "Absent effects add nothing: their outputs are zero or factor one, or what comes in"
  FESArm.Effects.JointTorque.NoJointTorque torque;
  FESArm.Effects.WristLoad.NoWristLoad load;
  FESArm.Effects.StimulationPath.DirectStimulation path;
  FESArm.Effects.MuscleStrength.NominalStrength strength;
  FESArm.Effects.MomentArm.NominalMomentArm momentArm;
  FESArm.Effects.Reflex.NoReflex reflex;
  FESArm.Effects.Field.NoField field;
  FESArm.Effects.JointSensor.TrueJointSensor jointSensor;
  FESArm.Effects.ForceSensor.TrueForceSensor forceSensor;
  output Real torqueError(unit="N.m") "Zero when no torque is added";
  output Real forceError(unit="N") "Zero when no force is added";
  output Real pathError(unit="1") "Zero when the activation is the command";
  output Real strengthError(unit="1") "Zero when every factor is one";
  output Real reflexError(unit="1") "Zero when no activation is added";
  output Real fieldError(unit="m/s2") "Zero when no field is added";
  output Real angleError(unit="rad"), readingError(unit="N") "Zero when the readings are the truth";
equation
  torque.q = {time, 2*time};
  torque.w = {1, 2};
  torque.a = {0, 0};
  load.r = {time, time};
  load.v = {1, 1};
  load.vdot = {3, 4};
  strength.alpha = fill(0.5, 6);
  path.u = fill(0.3*time, 6);
  torqueError = sum(abs(torque.tau));
  forceError = sum(abs(load.f));
  pathError = sum(abs(path.y - path.u));
  strengthError = sum(abs(strength.strength - ones(6))) + sum(abs(momentArm.factor - ones(6)));
  reflex.v = fill(time, 6);
  reflexError = sum(abs(reflex.added));
  fieldError = sum(abs(field.g));
  jointSensor.q = {time, 2*time};
  angleError = sum(abs(jointSensor.y - jointSensor.q));
  forceSensor.u = {3*time, 4};
  readingError = sum(abs(forceSensor.f - forceSensor.u));
  annotation (experiment(StopTime=1), Documentation(info="<html>
<p>Closed form: torques, forces, field and added activation are 0, factors are 1, and activations, angles and readings
pass unchanged, whatever comes in.</p>
</html>"));
end NoEffectIsTheSamePlant;
