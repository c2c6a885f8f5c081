within FESArm.Effects.ForceSensor;
model TrueForceSensor "Absent effect: the reading is the force"
  extends PartialForceSensor(present=false);
equation
  f = u;
end TrueForceSensor;
