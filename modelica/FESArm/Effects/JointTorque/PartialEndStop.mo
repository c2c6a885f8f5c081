within FESArm.Effects.JointTorque;
partial model PartialEndStop "Soft one-sided stop inside the range of a joint"
  import SI = FESArm.Units;
  extends PartialJointTorque;
  parameter SI.RotationalStiffness k[n](each min=0) = fill(0, n) "Stiffness of the stop";
  parameter SI.Angle qStop[n](each min=-1000, each max=1000) = fill(1, n) "Angle at which the stop begins";
  constant SI.Factor side "+1: acts above qStop, -1: acts below";
equation
  for i in 1:n loop
    tau[i] = -side*k[i]*max(0, side*(q[i] - qStop[i]));
  end for;
  annotation (Documentation(info="<html>
<p>tau = -k (q - qStop) beyond the stop, zero before it.</p>
<p>A spring that only pushes, without damping; the torque grows from zero. Derived here: the one-sided case of a
dead-zone spring.</p>
</html>"));
end PartialEndStop;
