within FESArm.Test;
model NoEffectIsTheSamePlant "Absent effects add nothing: their outputs are zero torque, zero force, the command, factor one"
  FESArm.Effects.JointTorque.NoJointTorque torque;
  FESArm.Effects.WristLoad.NoWristLoad load;
  FESArm.Effects.StimulationPath.DirectStimulation path;
  FESArm.Effects.MuscleStrength.NominalStrength strength;
  output Real torqueError(unit="N.m") "Zero when no torque is added";
  output Real forceError(unit="N") "Zero when no force is added";
  output Real pathError(unit="1") "Zero when the activation is the command";
  output Real strengthError(unit="1") "Zero when every factor is one";
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
  strengthError = sum(abs(strength.strength - ones(6)));
  annotation (experiment(StopTime=1));
end NoEffectIsTheSamePlant;
