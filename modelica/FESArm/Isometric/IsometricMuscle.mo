within FESArm.Isometric;
model IsometricMuscle "Stimulated muscle with series and parallel elasticity at an imposed length"
  import SI = FESArm.Units;
  import FESArm.Effects.StimulationPath;
  import FESArm.Effects.MuscleStrength;
  parameter SI.Force Fmax = 15.5 "Largest isometric force";
  parameter SI.Length Lopt = 0.0137 "Fibre length of the largest isometric force";
  parameter SI.Factor width = 0.5 "Half width of the force-length parabola over Lopt";
  parameter SI.QuadraticStiffness kSeries = 9.52e5 "Series elasticity";
  parameter SI.Length Lslack = 0.0288 "Slack length of the tendon";
  parameter SI.QuadraticStiffness kParallel = 2.87e4 "Parallel elasticity";
  parameter SI.Length Lparallel = 0.0151 "Fibre length at which the parallel elasticity starts";
  input SI.Fraction stimulation(start=0) "Excitation: 1 while the muscle is stimulated";
  input SI.Length length(start=0.0425) "Length of muscle and tendon";
  input SI.Force correction_force(start=0) "Force beside the model's own";
  output SI.Force force "Force of the muscle, positive when it pulls";
  replaceable model StimulationPath1 = StimulationPath.DirectStimulation constrainedby StimulationPath.PartialStimulationPath;
  StimulationPath1 stimulationPath1(n=1);
  replaceable model StimulationPath2 = StimulationPath.DirectStimulation constrainedby StimulationPath.PartialStimulationPath;
  StimulationPath2 stimulationPath2(n=1);
  replaceable model StimulationPath3 = StimulationPath.DirectStimulation constrainedby StimulationPath.PartialStimulationPath;
  StimulationPath3 stimulationPath3(n=1);
  replaceable model MuscleStrength1 = MuscleStrength.NominalStrength constrainedby MuscleStrength.PartialMuscleStrength;
  MuscleStrength1 muscleStrength1(n=1);
equation
  stimulationPath1.u = {stimulation};
  stimulationPath2.u = stimulationPath1.y;
  stimulationPath3.u = stimulationPath2.y;
  muscleStrength1.alpha = stimulationPath3.y;
  force = correction_force + equilibriumForce(stimulationPath3.y[1]*muscleStrength1.strength[1], length, Fmax, Lopt, width,
    kSeries, Lslack, kParallel, Lparallel);
  annotation (Documentation(info="<html>
<p>kSeries e^2 = q Fmax (1 - ((Lf - Lopt)/(width Lopt))^2) + kParallel max(0, Lf - Lparallel)^2 with Lf = length - Lslack
- e and the stimulation times the strength as q; solved in closed form by equilibriumForce. Assumption: equilibrium at
every instant.</p>
<p>Static part of a Hill muscle: force-length parabola, quadratic tendon, quadratic parallel elasticity, and activation
equal to the excitation. Lags found on top of it therefore lump activation with the fibre's shortening against its
tendon.</p>
</html>"));
end IsometricMuscle;
