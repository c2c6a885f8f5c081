within FESArm.Isometric;
function equilibriumForce "Force at which fibre, parallel and series elasticity are in equilibrium"
  input Real q(unit="1") "Active share of the largest force";
  input Real length(unit="m") "Length of muscle and tendon";
  input Real Fmax(unit="N") "Largest isometric force";
  input Real Lopt(unit="m") "Fibre length of the largest force";
  input Real width(unit="1") "Half width of the force-length parabola over Lopt";
  input Real kSeries(unit="N/m2") "Series elasticity: force over squared stretch";
  input Real Lslack(unit="m") "Slack length of the tendon";
  input Real kParallel(unit="N/m2") "Parallel elasticity: force over squared stretch";
  input Real Lparallel(unit="m") "Fibre length at which the parallel elasticity starts";
  output Real F(unit="N");
protected
  constant Real tiny(unit="N2/m2") = 1 "Keeps the root differentiable at rest; shifts the force by less than 1e-6 N";
  Real S(unit="m") "Stretch of the tendon if the fibre had its optimum length";
  Real C(unit="N/m2") "Curvature of the force-length parabola";
  Real P(unit="m") "Stretch of the parallel elasticity at the optimum length";
  Real e(unit="m") "Stretch of the tendon without parallel elasticity";
  Real ep(unit="m") "Stretch of the tendon with parallel elasticity";
algorithm
  S := length - Lslack - Lopt;
  C := q*Fmax/(width*Lopt)^2;
  P := Lopt - Lparallel;
  e := (C*S + sqrt(max((C*S)^2 + (kSeries + C)*(q*Fmax - C*S^2), tiny)))/(kSeries + C);
  ep := (C*S - kParallel*(S + P) + sqrt(max((C*S - kParallel*(S + P))^2
    + (kSeries + C - kParallel)*(q*Fmax - C*S^2 + kParallel*(S + P)^2), tiny)))/(kSeries + C - kParallel);
  F := kSeries*(if S + P - e > 0 then ep else e)^2;
  annotation (Documentation(info="<html>
<p>Solves kSeries e^2 = q Fmax (1 - ((S - e)/(width Lopt))^2) + kParallel max(0, S + P - e)^2 for the tendon stretch
e &gt;= 0; both branches are quadratics. The force-velocity relation is left out: the fibre is taken to be in equilibrium at
every instant.</p>
</html>"));
end equilibriumForce;
