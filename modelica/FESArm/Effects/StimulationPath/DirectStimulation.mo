within FESArm.Effects.StimulationPath;
model DirectStimulation "Absent effect: the activation is the command"
  extends PartialStimulationPath(present=false);
equation
  y = u;
  annotation (Documentation(info="<html><p>y = u: the muscles do what they are told, at once.</p></html>"));
end DirectStimulation;
