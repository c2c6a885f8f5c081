within FESArm.Test;
model ElasticJointSwings "Motor and load swing against each other about a mean that moves as the rigid drive does"
  FESArm.Plants.Drive drive(
    redeclare model Transmission1 = FESArm.Effects.Transmission.JointElasticity,
    transmission1(k=2, d=0, share=0.25),
    w(start=1));
  output Real torqueError(unit="N.m") "Zero when the beat is right";
  output Real meanError(unit="rad") "Zero when the centre moves as the rigid drive";
  output Real angleError(unit="rad") "Zero when the motor swings about the mean";
protected
  parameter Real k(unit="N.m/rad") = 2 "Stiffness in the drive";
  Real twist(unit="rad") "Torque over stiffness";
  Real omega(unit="rad/s") "Angular frequency of the twist";
  Real settled(unit="rad") "Mean twist: the share of the torque that accelerates the load, over the stiffness";
equation
  drive.torque = 0.03;
  drive.correction_phi = 0;
  twist = -drive.transmission1.tau/k;
  omega = sqrt(k/(0.25*0.75*drive.J));
  settled = 0.75*0.03/2;
  torqueError = drive.transmission1.tau + k*settled*(1 - cos(omega*time));
  meanError = drive.phi - 0.75*twist - time - 0.03/drive.J*time^2/2;
  angleError = drive.phi - time - 0.03/drive.J*time^2/2 - 0.75*settled*(1 - cos(omega*time));
  annotation (experiment(StopTime=1), Documentation(info="<html>
<p>The reduced inertia is share (1 - share) J; the centre of both masses, the motor's angle less 0.75 of the twist, feels the
torque alone.</p></html>"));
end ElasticJointSwings;
