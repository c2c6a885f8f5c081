within FESArm.Effects.JointTorque;
partial model PartialJointTorque "Contract: torque at the joints from their motion"
  import SI = FESArm.Units;
  parameter Boolean present = true "False in the absent effect only";
  parameter Integer n = 2 "Number of joints";
  input SI.Angle q[n] "Joint angles";
  input SI.AngularVelocity w[n] "= der(q)";
  input SI.AngularAcceleration a[n] "= der(w)";
  output SI.Torque tau[n] "Torque on the arm, positive in the direction of q";
end PartialJointTorque;
