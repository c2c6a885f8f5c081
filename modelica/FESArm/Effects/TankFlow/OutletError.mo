within FESArm.Effects.TankFlow;
model OutletError "Outflow coefficient off by a factor, as of a valve that is not where it should be"
  import SI = FESArm.Units;
  extends PartialTankFlow;
  parameter SI.Factor factor[n](each min=0, each max=3) = ones(n) "Flow over modelled flow";
equation
  for i in 1:n loop
    outlet[i] = (factor[i] - 1)*u[i];
  end for;
  lost = zeros(n);
  annotation (Documentation(info="<html>
<p>outlet = (factor - 1) u, so that factor u flows in all.</p>
<p>Derived here: Torricelli's outflow is proportional to the effective area of the outlet.</p>
</html>"));
end OutletError;
