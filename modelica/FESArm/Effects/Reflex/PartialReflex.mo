within FESArm.Effects.Reflex;
partial model PartialReflex "Contract: activation added by the motion of the muscles"
  import SI = FESArm.Units;
  parameter Boolean present = true "False in the absent effect only";
  parameter Integer n = 6 "Number of muscles";
  input Real v[n](each unit="1/s") "Lengthening speeds over optimum fibre lengths";
  output SI.Factor added[n] "Added activations";
  annotation (Documentation(info="<html>
<p>Activation of muscle i = its command behind the stimulation path + added<sub>i</sub>. The speed v = V/Lopt is
positive when the muscle lengthens, so a stretch reflex has added &ge; 0 for v &gt; 0. The sum is not limited to 1
here. Contract of this project.</p>
</html>"));
end PartialReflex;
