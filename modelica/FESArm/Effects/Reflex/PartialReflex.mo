within FESArm.Effects.Reflex;
partial model PartialReflex "Contract: activation added by the motion of the muscles"
  import SI = FESArm.Units;
  parameter Boolean present = true "False in the absent effect only";
  parameter Integer n = 6 "Number of muscles";
  input Real v[n](each unit="1/s") "Lengthening speeds over optimum fibre lengths";
  output SI.Factor added[n] "Added activations";
end PartialReflex;
