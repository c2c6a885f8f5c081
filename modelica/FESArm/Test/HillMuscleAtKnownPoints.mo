within FESArm.Test;
model HillMuscleAtKnownPoints "Force at the optimum, at known speeds and lengths"
  FESArm.Muscles.RigidTendonMuscle still, half, fastest, pulled, long(Kp=7500), narrow;
  FESArm.Muscles.PaperMuscle paper;
  FESArm.Muscles.MuscleAlone alone;
  output Real activeError(unit="N"), passiveError(unit="N") "Zero when the law is right";
equation
  still.alpha = 0.5;
  half.alpha = 1;
  fastest.alpha = 1;
  pulled.alpha = 1;
  long.alpha = 0;
  narrow.alpha = 1;
  paper.alpha = 0;
  still.strength = 0.8;
  half.strength = 1;
  fastest.strength = 1;
  pulled.strength = 1;
  long.strength = 1;
  narrow.strength = 1;
  paper.strength = 1;
  still.L = 0.0538 + 0.128;
  half.L = 0.0538 + 0.128;
  fastest.L = 0.0538 + 0.128;
  pulled.L = 0.0538 + 0.128;
  long.L = 0.0538 + 0.128 + 0.02;
  narrow.L = 0.0538 + 0.35*0.128;
  paper.L = 0.0538 - 0.02;
  still.V = 0;
  half.V = -0.64;
  fastest.V = -2;
  pulled.V = 0.128;
  long.V = 0;
  narrow.V = 0;
  paper.V = 0;
  alone.alpha = 0.5;
  alone.L = 0.0538 + 0.128;
  alone.V = 0;
  activeError = abs(still.F - 320) + abs(half.F - 800/6) + abs(fastest.F) + abs(pulled.F - 800*1.25) + abs(alone.F - 400)
    + abs(narrow.F - 800/exp(1));
  passiveError = abs(long.F - 3) + abs(paper.F - 3);
  annotation (experiment(StopTime=1), Documentation(info="<html>
<p>At the optimum length the force is alpha strength Fmax; at half the largest speed Hill's hyperbola gives
0.5/(1 + 0.5/0.25) = 1/6; above the largest speed nothing; lengthening with Vmax/10 = c the second hyperbola gives
(gmax + 1)/2. One width from the optimum the bell is 1/e. 20 mm beyond the optimum the passive force is
7500 0.02^2 = 3 N; the printed muscle has that also 20 mm below the slack length.</p></html>"));
end HillMuscleAtKnownPoints;
