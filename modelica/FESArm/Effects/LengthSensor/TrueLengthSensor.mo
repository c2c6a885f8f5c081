within FESArm.Effects.LengthSensor;
model TrueLengthSensor "Absent effect: the reading is the length"
  extends PartialLengthSensor(present=false);
equation
  y = x;
  annotation (Documentation(info="<html><p>y = x: the sensors show the truth.</p></html>"));
end TrueLengthSensor;
