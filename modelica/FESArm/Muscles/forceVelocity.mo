within FESArm.Muscles;
function forceVelocity "Share of the isometric force at a lengthening speed"
  input Real V(unit="m/s") "Lengthening speed, negative when the muscle shortens";
  input Real Vmax(unit="m/s") "Shortening speed at which no force is left";
  output Real gV(unit="1");
protected
  constant Real A(unit="1") = 0.25 "Shape of Hill's hyperbola";
  constant Real gmax(unit="1") = 1.5 "Force at fast lengthening over isometric force";
  Real c(unit="m/s") "Makes the lengthening branch level off at gmax";
algorithm
  c := Vmax*A*(gmax - 1)/(A + 1);
  gV := noEvent(if V <= 0 then max(0, (Vmax + min(V, 0))/(Vmax - min(V, 0)/A)) else (gmax*max(V, 0) + c)/(max(V, 0) + c));
  annotation (Documentation(info="<html>
<p>Shortening (V &lt;= 0): gV = (Vmax + V)/(Vmax - V/A). Lengthening: gV = (gmax V + c)/(V + c) with
c = Vmax A (gmax - 1)/(A + 1), which makes the slope continuous at V = 0.</p>
<p>Source: Hill, The heat of shortening and the dynamic constants of muscle, Proceedings of the Royal Society B 126 (1938),
for shortening. Hill's hyperbola is continued by a second hyperbola for lengthening; never negative. The inner
min and max keep each branch finite where it does not apply.</p>
</html>"));
end forceVelocity;
