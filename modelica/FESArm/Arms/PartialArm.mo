within FESArm.Arms;
partial model PartialArm "Two links, six muscles, slots for effects"
  import SI = FESArm.Units;
  import FESArm.Effects.JointTorque;
  import FESArm.Effects.WristLoad;
  import FESArm.Effects.StimulationPath;
  import FESArm.Effects.MuscleStrength;
  import FESArm.Effects.MomentArm;
  import FESArm.Effects.Tendon;
  import FESArm.Effects.Field;
  import FESArm.Effects.JointSensor;
  import FESArm.Effects.ForceSensor;
  import FESArm.Effects.Reflex;

  parameter SI.Force Fmax[6] = {800, 800, 1000, 1000, 700, 700} "Largest isometric forces";
  parameter SI.Length Lslack[6] = {0.0538, 0.0538, 0.2298, 0.1905, 0.1905, 0.0175} "Slack lengths of the tendons";
  parameter SI.Length Lopt[6] = {0.1280, 0.1280, 0.1422, 0.0877, 0.0877, 0.1028} "Optimum fibre lengths";
  parameter SI.Velocity Vmax[6] = {1.280, 1.280, 1.422, 0.877, 0.877, 1.028} "Largest shortening speeds";
  parameter SI.Length a0[6] = {0.1840, 0.1055, 0.4283, 0.1916, 0.2387, 0.1681} "Lengths at q = 0";
  parameter SI.Length d1[6] "Moment arms about the shoulder, flexors positive";
  parameter SI.Length d2[6] "Moment arms about the elbow, flexors positive";
  parameter SI.QuadraticStiffness Kp = 7500 "Stiffness of the passive forces";

  input SI.Fraction alpha_1(start=0) "Commanded activation, anterior deltoid";
  input SI.Fraction alpha_2(start=0) "Commanded activation, posterior deltoid";
  input SI.Fraction alpha_3(start=0) "Commanded activation, biceps";
  input SI.Fraction alpha_4(start=0) "Commanded activation, triceps long head";
  input SI.Fraction alpha_5(start=0) "Commanded activation, triceps short head";
  input SI.Fraction alpha_6(start=0) "Commanded activation, brachialis";
  input SI.Force fx(start=0) "External force on the arm at the wrist, world x";
  input SI.Force fy(start=0) "External force on the arm at the wrist, world y";
  input SI.Torque correction_q1(start=0) "Torque at the shoulder beside the model's own";
  input SI.Torque correction_q2(start=0) "Torque at the elbow beside the model's own";
  output SI.Angle q1 "Shoulder angle from the world x axis, flexion positive";
  output SI.Angle q2 "Elbow angle relative to the upper arm, flexion positive";

  replaceable FESArm.Muscles.RigidTendonMuscle muscle[6](Fmax=Fmax, Lslack=Lslack, Lopt=Lopt, Vmax=Vmax, each Kp=Kp)
    constrainedby FESArm.Muscles.PartialHillMuscle "The muscles and their law";
  FESArm.Linkage.PlanarLinkage linkage;

  replaceable model StimulationPath1 = StimulationPath.DirectStimulation constrainedby StimulationPath.PartialStimulationPath;
  StimulationPath1 stimulationPath1;
  replaceable model StimulationPath2 = StimulationPath.DirectStimulation constrainedby StimulationPath.PartialStimulationPath;
  StimulationPath2 stimulationPath2;
  replaceable model StimulationPath3 = StimulationPath.DirectStimulation constrainedby StimulationPath.PartialStimulationPath;
  StimulationPath3 stimulationPath3;
  replaceable model MuscleStrength1 = MuscleStrength.NominalStrength constrainedby MuscleStrength.PartialMuscleStrength;
  MuscleStrength1 muscleStrength1;
  replaceable model MuscleStrength2 = MuscleStrength.NominalStrength constrainedby MuscleStrength.PartialMuscleStrength;
  MuscleStrength2 muscleStrength2;
  replaceable model JointTorque1 = JointTorque.NoJointTorque constrainedby JointTorque.PartialJointTorque;
  JointTorque1 jointTorque1;
  replaceable model JointTorque2 = JointTorque.NoJointTorque constrainedby JointTorque.PartialJointTorque;
  JointTorque2 jointTorque2;
  replaceable model JointTorque3 = JointTorque.NoJointTorque constrainedby JointTorque.PartialJointTorque;
  JointTorque3 jointTorque3;
  replaceable model WristLoad1 = WristLoad.NoWristLoad constrainedby WristLoad.PartialWristLoad;
  WristLoad1 wristLoad1;
  replaceable model WristLoad2 = WristLoad.NoWristLoad constrainedby WristLoad.PartialWristLoad;
  WristLoad2 wristLoad2;
  replaceable model MomentArm1 = MomentArm.NominalMomentArm constrainedby MomentArm.PartialMomentArm;
  MomentArm1 momentArm1;
  replaceable model Tendon1 = Tendon.RigidTendon constrainedby Tendon.PartialTendon;
  Tendon1 tendon1(Fmax=Fmax, Lslack=Lslack, Lopt=Lopt, Vmax=Vmax, Kp=Kp);
  replaceable model Reflex1 = Reflex.NoReflex constrainedby Reflex.PartialReflex;
  Reflex1 reflex1;
  replaceable model Field1 = Field.NoField constrainedby Field.PartialField;
  Field1 field1;
  replaceable model JointSensor1 = JointSensor.TrueJointSensor constrainedby JointSensor.PartialJointSensor;
  JointSensor1 jointSensor1;
  replaceable model JointSensor2 = JointSensor.TrueJointSensor constrainedby JointSensor.PartialJointSensor;
  JointSensor2 jointSensor2;
  replaceable model ForceSensor1 = ForceSensor.TrueForceSensor constrainedby ForceSensor.PartialForceSensor;
  ForceSensor1 forceSensor1;
  replaceable model ForceSensor2 = ForceSensor.TrueForceSensor constrainedby ForceSensor.PartialForceSensor;
  ForceSensor2 forceSensor2;
protected
  SI.Torque tauMuscle[2] "Joint torques of the muscles";
  SI.Length r1[6] "Actual moment arms about the shoulder";
  SI.Length r2[6] "Actual moment arms about the elbow";
equation
  jointSensor1.q = linkage.q;
  jointSensor2.q = jointSensor1.y;
  q1 = jointSensor2.y[1];
  q2 = jointSensor2.y[2];

  stimulationPath1.u = {alpha_1, alpha_2, alpha_3, alpha_4, alpha_5, alpha_6};
  stimulationPath2.u = stimulationPath1.y;
  stimulationPath3.u = stimulationPath2.y;
  muscleStrength1.alpha = stimulationPath3.y;
  muscleStrength2.alpha = stimulationPath3.y;
  for i in 1:6 loop
    reflex1.v[i] = tendon1.V[i]/Lopt[i];
    muscle[i].alpha = stimulationPath3.y[i] + reflex1.added[i];
    muscle[i].strength = muscleStrength1.strength[i]*muscleStrength2.strength[i];
    r1[i] = momentArm1.factor[i]*d1[i];
    r2[i] = momentArm1.factor[i]*d2[i];
    tendon1.active[i] = muscle[i].alpha*muscle[i].strength;
    tendon1.L[i] = a0[i] - r1[i]*linkage.q[1] - r2[i]*linkage.q[2];
    tendon1.V[i] = -r1[i]*linkage.w[1] - r2[i]*linkage.w[2];
    tendon1.Frigid[i] = muscle[i].F;
    muscle[i].L = tendon1.Lfree[i];
    muscle[i].V = tendon1.Vfree[i];
  end for;
  tauMuscle[1] = r1[1]*tendon1.F[1] + r1[2]*tendon1.F[2] + r1[3]*tendon1.F[3]
    + r1[4]*tendon1.F[4] + r1[5]*tendon1.F[5] + r1[6]*tendon1.F[6];
  tauMuscle[2] = r2[1]*tendon1.F[1] + r2[2]*tendon1.F[2] + r2[3]*tendon1.F[3]
    + r2[4]*tendon1.F[4] + r2[5]*tendon1.F[5] + r2[6]*tendon1.F[6];

  jointTorque1.q = linkage.q;
  jointTorque1.w = linkage.w;
  jointTorque2.q = linkage.q;
  jointTorque2.w = linkage.w;
  jointTorque3.q = linkage.q;
  jointTorque3.w = linkage.w;
  linkage.tau = tauMuscle + jointTorque1.tau + jointTorque2.tau + jointTorque3.tau + {correction_q1, correction_q2};

  jointTorque1.a = linkage.a;
  jointTorque2.a = linkage.a;
  jointTorque3.a = linkage.a;

  wristLoad1.r = linkage.r;
  wristLoad1.v = linkage.v;
  wristLoad1.vdot = linkage.vdot;
  wristLoad2.r = linkage.r;
  wristLoad2.v = linkage.v;
  wristLoad2.vdot = linkage.vdot;
  forceSensor1.u = {fx, fy};
  forceSensor2.u = forceSensor1.f;
  linkage.g = field1.g;
  linkage.f = forceSensor2.f + wristLoad1.f + wristLoad2.f;
  annotation (Documentation(info="<html>
<p>Muscle length L = a0 - d1 q1 - d2 q2, joint torque d F: a flexor has a positive moment arm. Muscles in the order
anterior deltoid, posterior deltoid, biceps, triceps long head, triceps short head, brachialis. Muscle data are the
study's table.</p>
<p>Equations: those of <code>PlanarLinkage</code> and of the muscles; moment arms are constant, tendons run without
friction, activations and torques of all slots compose. Torque d F follows from the length by virtual work, F dL =
-tau dq.</p>
</html>"));
end PartialArm;
