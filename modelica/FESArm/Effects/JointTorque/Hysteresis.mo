within FESArm.Effects.JointTorque;
model Hysteresis "Torque that depends on the path (Bouc-Wen)"
  import SI = FESArm.Units;
  extends PartialJointTorque;
  parameter SI.Torque H[n](each min=0) = fill(0.05, n) "Torque of the fully developed loop";
  parameter SI.Angle xYield(min=1e-5) = 0.05 "Angle over which the torque develops";
  parameter SI.Factor sigma(min=0.5, max=1) = 0.7 "Shape of the loop: 0.5 unloads steeply, 1 as it loads";
  Real z[n](each unit="1", each start=0, each fixed=true, each min=-1, each max=1) "Share of the loop's torque";
equation
  for i in 1:n loop
    der(z[i]) = noEvent((w[i] - abs(w[i])*z[i]*sigma - w[i]*abs(z[i])*(1 - sigma))/xYield);
    tau[i] = -H[i]*z[i];
  end for;
  annotation (Documentation(info="<html>
<p>tau = -H z with xYield der(z) = w - sigma |w| z - (1 - sigma) w |z|, the Bouc-Wen law with exponent 1.</p>
<p>For sigma &ge; 0.5 the loop only takes energy. The torque does not depend on the speed, only on the path. Source:
Wen, Method for random vibration of hysteretic systems, Journal of the Engineering Mechanics Division 102 (1976), in
the normalised form of Ikhouane and Rodellar, Systems with Hysteresis (2007).</p>
</html>"));
end Hysteresis;
