within FESArm.Effects.Inflow;
partial model PartialInflow "Contract: from the commanded to the actual flow of a pump"
  import SI = FESArm.Units;
  parameter Boolean present = true "False in the absent effect only";
  input SI.VolumeFlowRate u "Commanded flow";
  output SI.VolumeFlowRate y "Flow that arrives";
  annotation (Documentation(info="<html><p>A law gives the flow that arrives from the commanded one.</p></html>"));
end PartialInflow;
