model Cylinder "Differential cylinder behind a proportional valve"
  parameter Real A[2](each unit="m2") = {1.96e-3, 1.0e-3} "piston and ring side";
  parameter Real V0[2](each unit="m3") = {2.5e-4, 4.5e-4} "dead volumes";
  parameter Real m(unit="kg") = 85, b(unit="N.s/m") = 1800;
  parameter Real beta(unit="Pa") = 1.1e9 "bulk modulus";
  parameter Real kv = 9.5e-8 "m3/s per sqrt(Pa) at full opening";
  parameter Real pS(unit="Pa") = 120e5, pT(unit="Pa") = 2e5;
  input Real y(min=-1, max=1) "valve opening";
  input Real F(unit="N") "load, against extension";
  output Real x(unit="m", start=0.1);
  output Real p[2](each unit="Pa", start={35e5, 68.6e5});
  Real v(unit="m/s", start=0);
  Real q[2](each unit="m3/s") "into the chambers";
equation
  q[1] = kv*(if y > 0 then y*sqrt(max(pS - p[1], 1)) else y*sqrt(max(p[1] - pT, 1)));
  q[2] = -kv*(if y > 0 then y*sqrt(max(p[2] - pT, 1)) else y*sqrt(max(pS - p[2], 1)));
  (V0[1] + A[1]*x)/beta*der(p[1]) = q[1] - A[1]*v;
  (V0[2] - A[2]*x)/beta*der(p[2]) = q[2] + A[2]*v;
  der(x) = v;
  m*der(v) = A*{p[1], -p[2]} - b*v - F;
end Cylinder;
