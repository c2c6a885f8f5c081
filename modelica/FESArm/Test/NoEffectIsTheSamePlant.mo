within FESArm.Test;
model NoEffectIsTheSamePlant "Absent effects add nothing: their outputs are zero torque, zero force, the command, factor one"
  FESArm.Effects.JointTorque.NoJointTorque torque;
  FESArm.Effects.WristLoad.NoWristLoad load;
  FESArm.Effects.StimulationPath.DirectStimulation path;
  FESArm.Effects.MuscleStrength.NominalStrength strength;
  output Real error "Zero when nothing is added";
equation
  torque.q = {time, 2*time};
  torque.w = {1, 2};
  torque.a = {0, 0};
  load.r = {time, time};
  load.v = {1, 1};
  load.vdot = {3, 4};
  strength.alpha = fill(0.5, 6);
  path.u = fill(0.3*time, 6);
  error = sum(abs(torque.tau)) + sum(abs(load.f)) + sum(abs(path.y - path.u)) + sum(abs(strength.strength - ones(6)));
  annotation (experiment(StopTime=1));
end NoEffectIsTheSamePlant;
