within FESArm.Effects.TankFlow;
partial model PartialTankFlow "Contract: flows out of tanks beside the modelled ones"
  import SI = FESArm.Units;
  parameter Boolean present = true "False in the absent effect only";
  parameter Integer n = 2 "Number of tanks";
  input SI.Length h[n] "Levels";
  input SI.VolumeFlowRate u[n] "Modelled flows through the outlets";
  output SI.VolumeFlowRate outlet[n] "Flows through the outlets beside the modelled ones";
  output SI.VolumeFlowRate lost[n] "Flows out of the tanks to nowhere";
  annotation (Documentation(info="<html><p>A law gives flows beside the modelled ones: through the outlets, where they arrive in the next tank, and to nowhere.</p></html>"));
end PartialTankFlow;
