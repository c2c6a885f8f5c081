within FESArm.Effects.StimulationPath;
model DirectStimulation "Absent effect: the activation is the command"
  extends PartialStimulationPath(present=false);
equation
  y = u;
end DirectStimulation;
