within FESArm.Effects.TankFlow;
model TankLeak "Leak at the bottom of a tank"
  import SI = FESArm.Units;
  extends PartialTankFlow;
  parameter SI.Area leak[n](each min=0) = zeros(n) "Effective areas of the leaks";
  parameter SI.Acceleration g = 9.81 "Gravity";
  parameter SI.Length hSmall = 1e-4 "Level below which the flow is no longer Torricelli's";
equation
  for i in 1:n loop
    outlet[i] = 0;
    lost[i] = leak[i]*sqrt(2*g)*h[i]/sqrt(sqrt(h[i]^2 + hSmall^2));
  end for;
  annotation (Documentation(info="<html>
<p>lost = leak sqrt(2 g h) by Torricelli, regularised as in <code>Plants.TwoTanks</code>. What leaks does not arrive
in another tank.</p>
<p>Source: Torricelli's law, for example Batchelor, An Introduction to Fluid Dynamics (1967), chapter 6.</p>
</html>"));
end TankLeak;
