within FESArm.Effects.ForceSensor;
model TrueForceSensor "Absent effect: the reading is the force"
  extends PartialForceSensor(present=false);
equation
  f = u;
  annotation (Documentation(info="<html><p>f = u: the sensor shows what acts.</p></html>"));
end TrueForceSensor;
