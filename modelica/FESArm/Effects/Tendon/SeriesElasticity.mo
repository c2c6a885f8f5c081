within FESArm.Effects.Tendon;
model SeriesElasticity "Tendons that stretch with their force"
  import SI = FESArm.Units;
  extends PartialTendon;
  parameter SI.Factor strain(min=0.002, max=0.2) = 0.03 "Stretch over slack length at the largest isometric force";
  parameter SI.Factor damping(min=0.01, max=1) = 0.05 "Force of the damper beside the fibre at Vmax over Fmax";
  parameter SI.Time creep(min=0, max=0.01) = 2e-3 "Time constant of the tendon's own damping";
  SI.Length stretch[n](each start=0, each fixed=true, each min=-0.01, each max=0.02) "Stretches; negative when slack";
protected
  Real k[n](each unit="N/m") "Stiffness of a tendon, zero when slack";
  Real B[n](each unit="N.s/m") "Damping beside the fibre";
  SI.Length fibre[n] "Fibre lengths";
  SI.Force isometric[n] "Active forces without motion";
  SI.Force passive[n] "Passive forces";
  SI.Velocity held[n] "Speeds of the fibres as long as the tendons pull";
  SI.Velocity speed[n] "Speeds of the fibres";
equation
  for i in 1:n loop
    k[i] = noEvent(if stretch[i] > 0 then Fmax[i]/(strain*Lslack[i]) else 0);
    B[i] = damping*Fmax[i]/Vmax[i];
    fibre[i] = L[i] - stretch[i] - Lslack[i];
    isometric[i] = active[i]*Fmax[i]*FESArm.Muscles.forceLength(fibre[i], Lopt[i]);
    passive[i] = Kp*max(0, fibre[i] - Lopt[i])^2;
    held[i] = fibreSpeed(k[i]*(stretch[i] + creep*V[i]) - passive[i], isometric[i], B[i] + creep*k[i], Vmax[i]);
    F[i] = max(0, k[i]*(stretch[i] + creep*(V[i] - held[i])));
    speed[i] = noEvent(if F[i] > 0 then held[i] else fibreSpeed(-passive[i], isometric[i], B[i], Vmax[i]));
    der(stretch[i]) = V[i] - speed[i];
    Lfree[i] = L[i] - stretch[i];
    Vfree[i] = speed[i];
  end for;
  annotation (Documentation(info="<html>
<p>Tendon force = k (s + creep der(s)) with k = Fmax/(strain Lslack) while it is stretched by s &gt; 0, never
negative, and zero when slack. The fibre's speed v = V - der(s) is the one at which fibre, passive force and a damper
damping Fmax/Vmax beside the fibre pull as hard as the tendon. The damper keeps the speed finite without
activation; the tendon's own damping limits how stiff the equations are, to rates of 1/creep that steps of
4 ms follow, and delays the force by as much. The law of the fibre is that of <code>RigidTendonMuscle</code>. No pennation, no toe region. Source: Zajac,
Muscle and tendon, CRC Critical Reviews in Biomedical Engineering 17 (1989), which gives a strain of 0.033 at the
largest force.</p></html>"));
end SeriesElasticity;
