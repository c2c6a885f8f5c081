within FESArm.Effects.TankFlow;
model NoTankFlow "Absent effect: no other flows"
  extends PartialTankFlow(present=false);
equation
  outlet = zeros(n);
  lost = zeros(n);
  annotation (Documentation(info="<html><p>outlet = 0 and lost = 0: only the modelled flows.</p></html>"));
end NoTankFlow;
