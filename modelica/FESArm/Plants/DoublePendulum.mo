within FESArm.Plants;
model DoublePendulum "Two links that swing under gravity"
  import SI = FESArm.Units;
  import FESArm.Effects.JointTorque;
  import FESArm.Effects.JointSensor;
  parameter SI.Acceleration g = 9.81 "Gravity, against the y axis";
  input SI.Torque correction_q1(start=0) "Torque at the first joint beside the model's own";
  input SI.Torque correction_q2(start=0) "Torque at the second joint beside the model's own";
  output SI.Angle q1 "Reading: first link from the horizontal x axis: -pi/2 when hanging";
  output SI.Angle q2 "Reading: second link relative to the first";
  FESArm.Linkage.PlanarLinkage linkage(
    l={0.25, 0.25},
    m={0.20, 0.15},
    c={0.125, 0.125},
    I={1.1e-3, 0.8e-3},
    b={0, 0},
    q(start={0.0, 0.3})) "Both links";
  replaceable model JointTorque1 = JointTorque.NoJointTorque constrainedby JointTorque.PartialJointTorque;
  JointTorque1 jointTorque1(n=2);
  replaceable model JointTorque2 = JointTorque.NoJointTorque constrainedby JointTorque.PartialJointTorque;
  JointTorque2 jointTorque2(n=2);
  replaceable model JointTorque3 = JointTorque.NoJointTorque constrainedby JointTorque.PartialJointTorque;
  JointTorque3 jointTorque3(n=2);
  replaceable model JointSensor1 = JointSensor.TrueJointSensor constrainedby JointSensor.PartialJointSensor;
  JointSensor1 jointSensor1(n=2);
  replaceable model JointSensor2 = JointSensor.TrueJointSensor constrainedby JointSensor.PartialJointSensor;
  JointSensor2 jointSensor2(n=2);
equation
  jointTorque1.q = linkage.q;
  jointTorque1.w = linkage.w;
  jointTorque1.a = linkage.a;
  jointTorque2.q = linkage.q;
  jointTorque2.w = linkage.w;
  jointTorque2.a = linkage.a;
  jointTorque3.q = linkage.q;
  jointTorque3.w = linkage.w;
  jointTorque3.a = linkage.a;
  jointSensor1.q = linkage.q;
  jointSensor2.q = jointSensor1.y;
  q1 = jointSensor2.y[1];
  q2 = jointSensor2.y[2];
  linkage.tau = jointTorque1.tau + jointTorque2.tau + jointTorque3.tau + {correction_q1, correction_q2};
  linkage.f = {0, 0};
  linkage.g = {0, -g};
  annotation (Documentation(info="<html>
<p>The linkage of the arm in a vertical plane, without damping and muscles: M(q) a + h(q, w) = torques at the joints + weight.
The links are uniform bars of 0.25 m, chosen for this project.</p>
</html>"));
end DoublePendulum;
