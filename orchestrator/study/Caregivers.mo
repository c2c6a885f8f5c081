package Caregivers "People who hold the arm of the study while its muscles are stimulated"
  import SI = FESArm.Units;

  model JointStop "Ends of the range of motion: springs with damping while they are touched"
    extends FESArm.Effects.JointTorque.PartialJointTorque;
    parameter SI.Angle qLow[n] = {-0.2, 0.3} "Where the lower stops begin";
    parameter SI.Angle qHigh[n] = {1.7, 2.4} "Where the upper stops begin";
    parameter SI.RotationalStiffness k = 500 "Stiffness of the stops";
    parameter SI.RotationalDamping d = 10 "Damping once a stop is deep in contact";
    parameter SI.Angle depth = 0.02 "Depth over which the damping sets in";
  protected
    SI.Angle above[n] "How far beyond the upper stop";
    SI.Angle below[n] "How far beyond the lower stop";
  equation
    for i in 1:n loop
      above[i] = max(0, q[i] - qHigh[i]);
      below[i] = max(0, qLow[i] - q[i]);
      tau[i] = k*(below[i] - above[i]) - d*min(1, (above[i] + below[i])/depth)*w[i];
    end for;
    annotation (Documentation(info="<html>
<p>tau = -k (q - qHigh) - d w beyond a stop, nothing before it. Damping sets in with the depth, so that the torque is
continuous. The study's robot has ends of its range; where they are is not printed, these are this project's.</p>
</html>"));
  end JointStop;

  model HeldArm "The arm with the printed parameter set, joint stops, and its wrist to hold on to"
    extends FESArm.Arms.ArmPaper(redeclare model JointTorque1 = JointStop);
    output SI.Length x "Wrist, world x";
    output SI.Length y "Wrist, world y";
    output SI.Velocity vx "= der(x)";
    output SI.Velocity vy "= der(y)";
    output SI.AngularVelocity w1 "= der(q1)";
    output SI.AngularVelocity w2 "= der(q2)";
  equation
    x = linkage.r[1];
    y = linkage.r[2];
    vx = linkage.v[1];
    vy = linkage.v[2];
    w1 = linkage.w[1];
    w2 = linkage.w[2];
    annotation (Documentation(info="<html><p>Nothing is added to the equations of <code>ArmPaper</code> but the stops.</p></html>"));
  end HeldArm;

  model Caregiver "Somebody who tries to hold the wrist still"
    parameter SI.Length x0 = 0 "Where the wrist should be, world x";
    parameter SI.Length y0 = 0 "Where the wrist should be, world y";
    parameter SI.Force hx = 0 "Push at the beginning, world x";
    parameter SI.Force hy = 0 "Push at the beginning, world y";
    parameter Real K(unit="N/m") = 1200 "Stiffness of both arms, without thinking";
    parameter SI.Damping B = 60 "Damping of both arms, without thinking";
    parameter SI.Time reaction(min=0.001, max=0.6) = 0.2 "Time until a deviation is answered on purpose";
    parameter SI.Time lag(min=0.001) = 0.08 "Time in which the push on purpose builds up";
    parameter Real Ki(unit="N/(m.s)") = 600 "How fast the push on purpose adapts to a lasting deviation";
    parameter SI.Damping Kd = 60 "Push on purpose against motion that was seen";
    parameter SI.Force Fmax(min=1) = 140 "Largest push";
    parameter SI.Factor share = 0.08 "Unsteadiness of a push, as a share of it";
    parameter SI.Force rest = 1.5 "Unsteadiness without a push";
    parameter SI.Frequency tremor[4] = {0.7, 1.6, 3.5, 9} "Frequencies of the unsteadiness";
    parameter SI.Angle phaseX[4] = {0, 1, 2, 3} "Phases, world x";
    parameter SI.Angle phaseY[4] = {3, 0, 1, 2} "Phases, world y";
    input SI.Length x(start=0) "Wrist, world x";
    input SI.Length y(start=0) "Wrist, world y";
    input SI.Velocity vx(start=0) "= der(x)";
    input SI.Velocity vy(start=0) "= der(y)";
    output SI.Force fx "Push on the arm, world x";
    output SI.Force fy "Push on the arm, world y";
  protected
    SI.Force adapted[2](start={hx, hy}, each fixed=true) "What has been learnt about the lasting push";
    SI.Force meant[2](start={hx, hy}, each fixed=true) "Push on purpose";
    SI.Length late[2] "Deviation as it is known by now";
    SI.Velocity lateV[2] "Motion as it is known by now";
    SI.Force wanted[2] "Push before the limit of strength";
    SI.Force strength "Size of that";
    SI.Factor kept "Share of it that strength allows";
    SI.Factor shake[2] "Unsteadiness, of unit variance";
  equation
    late[1] = x0 - delay(x, reaction, 0.6);
    late[2] = y0 - delay(y, reaction, 0.6);
    lateV[1] = delay(vx, reaction, 0.6);
    lateV[2] = delay(vy, reaction, 0.6);
    shake[1] = (sin(6.283185307179586*tremor[1]*time + phaseX[1]) + sin(6.283185307179586*tremor[2]*time + phaseX[2])
      + sin(6.283185307179586*tremor[3]*time + phaseX[3]) + sin(6.283185307179586*tremor[4]*time + phaseX[4]))/sqrt(2);
    shake[2] = (sin(6.283185307179586*tremor[1]*time + phaseY[1]) + sin(6.283185307179586*tremor[2]*time + phaseY[2])
      + sin(6.283185307179586*tremor[3]*time + phaseY[3]) + sin(6.283185307179586*tremor[4]*time + phaseY[4]))/sqrt(2);
    for i in 1:2 loop
      der(adapted[i]) = Ki*late[i] - max(0, abs(adapted[i]) - Fmax)*(if adapted[i] > 0 then 1 else -1)/lag;
      der(meant[i]) = (adapted[i] - Kd*lateV[i] - meant[i])/lag;
    end for;
    wanted[1] = K*(x0 - x) - B*vx + meant[1];
    wanted[2] = K*(y0 - y) - B*vy + meant[2];
    strength = sqrt(wanted[1]^2 + wanted[2]^2 + 1e-6);
    kept = min(1, Fmax/strength);
    fx = kept*wanted[1] + (share*kept*strength + rest)*shake[1];
    fy = kept*wanted[2] + (share*kept*strength + rest)*shake[2];
    annotation (Documentation(info="<html>
<p>f = limit(K (x0 - x) - B v + u) + unsteadiness. The hands are a spring and a damper at once; what is done on purpose, u,
answers the deviation and the motion of a reaction time ago: an integral of the deviation that adapts slowly, and damping,
both through a lag. The push never exceeds Fmax but for the unsteadiness, which grows with the push.</p>
<p>Sizes are general knowledge of people (two arms that stiffen: some hundred to 1500 N/m; reaction 0.15 to 0.25 s; sustained
push 75 to 200 N), not measurements. No error is put in: all errors of corrections follow from this behaviour.</p>
</html>"));
  end Caregiver;
end Caregivers;
