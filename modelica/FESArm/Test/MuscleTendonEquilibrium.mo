within FESArm.Test;
model MuscleTendonEquilibrium "Tendon force equals the force of fibre and parallel elasticity at every activation and length"
  FESArm.Isometric.IsometricMuscle muscle;
  output Real forceError(unit="N") "Zero when the equilibrium is right";
protected
  Real L(unit="m") "Fibre length that follows from the tendon's stretch";
equation
  muscle.stimulation = time;
  muscle.length = 0.040 + 0.007*time;
  muscle.correction_force = 0;
  L = muscle.length - muscle.Lslack - sqrt(muscle.force/muscle.kSeries);
  forceError = muscle.force - time*muscle.Fmax*(1 - ((L/muscle.Lopt - 1)/muscle.width)^2)
    - muscle.kParallel*max(0, L - muscle.Lparallel)^2;
  annotation (experiment(StopTime=1));
end MuscleTendonEquilibrium;
