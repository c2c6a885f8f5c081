within FESArm.Effects.JointSensor;
partial model PartialJointSensor "Contract: reading of the encoders"
  import SI = FESArm.Units;
  parameter Boolean present = true "False in the absent effect only";
  parameter Integer n = 2 "Number of joints";
  input SI.Angle q[n] "True angles";
  output SI.Angle y[n] "Readings";
end PartialJointSensor;
