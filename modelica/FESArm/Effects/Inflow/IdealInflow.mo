within FESArm.Effects.Inflow;
model IdealInflow "Absent effect: what is commanded arrives"
  extends PartialInflow(present=false);
equation
  y = u;
  annotation (Documentation(info="<html><p>y = u: what is commanded arrives unchanged.</p></html>"));
end IdealInflow;
