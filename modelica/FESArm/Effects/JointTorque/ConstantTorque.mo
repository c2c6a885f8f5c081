within FESArm.Effects.JointTorque;
model ConstantTorque "Steady torque at the joints"
  import SI = FESArm.Units;
  extends PartialJointTorque;
  parameter SI.Torque tau0[n] = fill(0.05, n) "Torque, positive in the direction of q";
equation
  tau = tau0;
  annotation (Documentation(info="<html>
<p>tau = tau0.</p>
<p>Neither posture nor motion matters. Derived here: the simplest torque that is left when all else balances, such as
a bias of a drive's current.</p>
</html>"));
end ConstantTorque;
