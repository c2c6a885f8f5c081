model Crane "Trolley with a load on a rope of constant length"
  parameter Real M(unit="kg")=120, m(unit="kg")=65 "trolley, load";
  parameter Real l(unit="m")=3.2 "rope";
  parameter Real d(unit="N.s/m")=45 "rolling resistance";
  constant Real g(unit="m/s2")=9.81;
  input Real F(unit="N") "drive";
  output Real x(unit="m", start=0, fixed=true);
  output Real phi(unit="rad", start=0, fixed=true) "rope angle, positive ahead";
protected
  Real v(unit="m/s", start=0);
  Real w(unit="rad/s", start=0);
equation
  der(x) = v; der(phi) = w;
  F = (M + m)*der(v) + m*l*cos(phi)*der(w) - m*l*w^2*sin(phi) + d*v;
  m*l^2*der(w) + m*l*cos(phi)*der(v) = -m*g*l*sin(phi);
end Crane;
