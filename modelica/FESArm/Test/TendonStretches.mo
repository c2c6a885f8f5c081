within FESArm.Test;
model TendonStretches "An elastic tendon relaxes exponentially, stays slack without a pull, and carries its muscle's force"
  FESArm.Effects.Tendon.SeriesElasticity pulled(n=1, Fmax={100}, Lslack={0.1}, Lopt={0.1}, Vmax={1}, strain=0.05, damping=1,
    creep=5e-4, stretch(start={0.002}));
  FESArm.Effects.Tendon.SeriesElasticity slack(n=1, Fmax={100}, Lslack={0.1}, Lopt={0.1}, Vmax={1}, stretch(start={-0.001}));
  FESArm.Effects.Tendon.SeriesElasticity working(n=1, Fmax={800}, strain=0.05, stretch(start={0.001}));
  FESArm.Muscles.RigidTendonMuscle muscle "Its fibre is that of the working one";
  output Real stretchError(unit="m"), slackError(unit="m") "Zero when the tendon stretches as it must";
  output Real pullError(unit="N") "Zero when a slack tendon does not pull";
  output Real forceError(unit="1") "Zero when tendon, fibre and damper pull alike";
  output Real speedError(unit="m/s") "Zero when the speed is that at which the fibre pulls so";
protected
  Real settled(unit="m") "Stretch under the damper's force at constant speed";
  Real v(unit="m/s") "A speed from fast shortening to fast lengthening";
equation
  settled = 100*0.1/20000;
  pulled.active = {0};
  pulled.V = {0.1};
  pulled.L = {0.15 + 0.1*time};
  pulled.Frigid = {0};
  stretchError = pulled.stretch[1] - settled - (0.002 - settled)*exp(-20000*time/(100 + 20000*5e-4));
  slack.active = {0};
  slack.V = {-0.1};
  slack.L = {0.15 - 0.1*time};
  slack.Frigid = {0};
  slackError = slack.stretch[1] + 0.001 + 0.1*time;
  working.active = {0.5 + 10*time};
  working.V = {0.3};
  working.L = {0.19 + 0.3*time};
  working.Frigid = {muscle.F};
  muscle.alpha = 0.5 + 10*time;
  muscle.strength = 1;
  muscle.L = working.Lfree[1];
  muscle.V = working.Vfree[1];
  pullError = slack.F[1];
  forceError = working.F[1]/muscle.Fmax - muscle.F/muscle.Fmax - 0.05*working.Vfree[1]/muscle.Vmax;
  v = -1.5 + 100*time;
  speedError = FESArm.Effects.Tendon.fibreSpeed(0.4*800*FESArm.Muscles.forceVelocity(v, 1.28) + 30*v, 0.4*800, 30, 1.28) - v;
  annotation (experiment(StopTime=0.02), Documentation(info="<html>
<p>Without activation only the damper B = 100 N.s/m holds the fibre, and k = 20 kN/m: (B + creep k) der(s) = B V - k s. A slack
tendon follows its path while the fibre stays. The muscle on the rest of the path pulls as the tendon does, less the
damper beside the fibre; the error counts in shares of the largest force.</p></html>"));
end TendonStretches;
