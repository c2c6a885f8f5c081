within FESArm.Effects.Actuator;
model IdealActuator "Absent effect: what is commanded is delivered"
  extends PartialActuator(present=false);
equation
  y = u;
  annotation (Documentation(info="<html><p>y = u: what is commanded arrives unchanged.</p></html>"));
end IdealActuator;
