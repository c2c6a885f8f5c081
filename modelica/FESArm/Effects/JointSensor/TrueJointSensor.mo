within FESArm.Effects.JointSensor;
model TrueJointSensor "Absent effect: the reading is the angle"
  extends PartialJointSensor(present=false);
equation
  y = q;
end TrueJointSensor;
