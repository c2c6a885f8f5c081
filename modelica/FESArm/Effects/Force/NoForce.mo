within FESArm.Effects.Force;
model NoForce "Absent effect: no force"
  extends PartialForce(present=false);
equation
  f = zeros(n);
  annotation (Documentation(info="<html><p>f = 0: nothing acts on the slide.</p></html>"));
end NoForce;
