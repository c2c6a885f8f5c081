within FESArm.Effects.WristLoad;
partial model PartialWristLoad "Contract: force at the wrist from its motion"
  import SI = FESArm.Units;
  parameter Boolean present = true "False in the absent effect only";
  input SI.Length r[2] "Position of the wrist, world axes";
  input SI.Velocity v[2] "= der(r)";
  input SI.Acceleration vdot[2] "= der(v)";
  output SI.Force f[2] "Force on the arm, world axes";
  annotation (Documentation(info="<html>
<p>An effect states f = F(r, v, vdot, its own states, time); forces of all slots add to the measured force and enter
the joints as J(q)' f, by virtual work (Spong, Hutchinson, Vidyasagar, Robot Modeling and Control, 2006, chapter 4).
The power given to the arm is f v. The load acts at one point, the wrist, without a moment. It may use the
acceleration only linearly.</p>
</html>"));
end PartialWristLoad;
