within FESArm.Effects.JointSensor;
model TrueJointSensor "Absent effect: the reading is the angle"
  extends PartialJointSensor(present=false);
equation
  y = q;
  annotation (Documentation(info="<html><p>y = q: the encoders show the angles.</p></html>"));
end TrueJointSensor;
