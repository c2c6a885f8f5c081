within FESArm.Effects.StimulationPath;
model ActivationDynamics "First-order lag, different on the way up and down"
  import SI = FESArm.Units;
  extends PartialStimulationPath;
  parameter SI.Time tauUp(min=0.002, max=0.5) = 0.03 "Time constant when the activation rises";
  parameter SI.Time tauDown(min=0.002, max=0.5) = 0.05 "Time constant when the activation falls";
  SI.Fraction a[n](each start=0, each fixed=true) "Actual activations";
equation
  for i in 1:n loop
    der(a[i]) = noEvent(if u[i] > a[i] then (u[i] - a[i])/tauUp else (u[i] - a[i])/tauDown);
    y[i] = a[i];
  end for;
  annotation (Documentation(info="<html>
<p>der(a) = (u - a)/tau with tau = tauUp for u &gt; a, else tauDown. The right-hand side is continuous where the
branches meet.</p>
<p>The activation itself is the state; its rate does not depend on it otherwise. Source: Zajac, Muscle and tendon,
Critical Reviews in Biomedical Engineering 17 (1989), whose time constant also depends on the command, taken as
piecewise constant here.</p>
</html>"));
end ActivationDynamics;
