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
  annotation (experiment(StopTime=1), Documentation(info="<html>
<p>The tendon kSeries (length - Lslack - L)^2 = F gives the fibre length L = length - Lslack - sqrt(F/kSeries); at
this length F must be the fibre's alpha Fmax (1 - ((L/Lopt - 1)/width)^2) + kParallel max(0, L - Lparallel)^2. The
force is put in and the balance comes out: no equation is solved here.</p>
</html>"));
end MuscleTendonEquilibrium;
