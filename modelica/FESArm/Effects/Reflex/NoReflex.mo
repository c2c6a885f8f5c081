within FESArm.Effects.Reflex;
model NoReflex "Absent effect"
  extends PartialReflex(present=false);
equation
  added = zeros(n);
  annotation (Documentation(info="<html><p>added = 0: stimulation is the only source of activation.</p></html>"));
end NoReflex;
