within FESArm.Effects.Tendon;
function fibreSpeed "Speed at which a fibre with a light damper beside it pulls with a given force"
  input Real P(unit="N") "Pull of the tendon less the passive force";
  input Real active(unit="N") "Isometric force of the fibre";
  input Real B(unit="N.s/m") "Damping beside the fibre";
  input Real Vmax(unit="m/s") "Largest shortening speed";
  output Real v(unit="m/s") "Lengthening speed";
protected
  constant Real A(unit="1") = 0.25 "Shape of Hill's hyperbola, as in forceVelocity";
  constant Real gmax(unit="1") = 1.5 "Force at fast lengthening over isometric force, as in forceVelocity";
  Real c(unit="m/s") "Makes the lengthening branch level off at gmax";
  Real up(unit="N"), down(unit="N") "Surplus of the pull over the isometric force, and the reverse, not negative";
  Real b(unit="N") "Middle coefficient of the quadratic of the branch";
algorithm
  c := Vmax*A*(gmax - 1)/(A + 1);
  up := max(P - active, 0);
  down := max(active - P, 0);
  b := noEvent(if P > active then B*c + gmax*active - P else P/A + B*Vmax + active);
  v := noEvent(if P > active then 2*c*up/(b + sqrt(b^2 + 4*B*c*up))
    else if P > -B*Vmax then -2*Vmax*down/(b + sqrt(b^2 + 4*B/A*Vmax*down)) else P/B);
  annotation (Documentation(info="<html>
<p>Solves active g(v) + B v = P for v, where g is <code>Muscles.forceVelocity</code>. On each branch of g this is a
quadratic; its root is written so that nothing cancels near v = 0. Beyond the largest shortening speed g is zero.</p>
<p>The damper makes the speed unique at any activation. Derived here: with c = Vmax A (gmax - 1)/(A + 1) the
lengthening branch is B v^2 + (B c + gmax active - P) v + c (active - P) = 0.</p>
</html>"));
end fibreSpeed;
