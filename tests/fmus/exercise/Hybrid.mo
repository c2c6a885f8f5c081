model Hybrid "Something of each kind: start to be solved for, a root, stiffness, a delay, events of state and time"
  input Real u(start=0);
  parameter Real k = 2;
  parameter Real c = 2*k;
  Real x(start=1);
  Real z(start=0.5);
  Real r[2](each start=0.48, each fixed=true);
  output Real y;
  output Real late;
initial equation
  der(x) = 0;
equation
  der(x) = u + 1 - k*x^3;
  z + z^3 = x;
  der(r[1]) = if r[2] > 0.5 then 0.2 else 1;
  der(r[2]) = 1e5*(r[1] - r[2]);
  y = z + r[1] + (if time > 0.0512 then c else 0);
  late = delay(u, 0.02, 0.1);
end Hybrid;
