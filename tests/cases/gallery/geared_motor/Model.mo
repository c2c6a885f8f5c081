package Units
  type Voltage = Real(unit = "V");
  type Current = Real(unit = "A");
  type Angle = Real(unit = "rad");
  type Speed = Real(unit = "rad/s");
  type Torque = Real(unit = "N.m");
end Units;

model GearedMotor "Brushed DC motor, spur gear 1:12 and a swinging load"
  import SI = Units;
  parameter Real R(unit = "Ohm") = 1.9 "armature resistance";
  parameter Real L(unit = "H") = 1.2e-3;
  parameter Real k(unit = "N.m/A") = 0.052 "torque constant";
  parameter Real Jm(unit = "kg.m2") = 2.4e-5 "rotor";
  parameter Real Jl(unit = "kg.m2") = 9.5e-3 "load";
  parameter Real n = 12 "gear ratio";
  parameter Real b(unit = "N.m.s/rad") = 8e-3 "grease in the gear, at the load";
  parameter Real mgl(unit = "N.m") = 0.35 "weight of the load times its lever";
  input SI.Voltage u;
  SI.Current i(start = 0);
  SI.Angle phi(start = 0) "load angle, 0 hanging";
  SI.Speed w(start = 0);
  Real a(unit = "rad/s2");
  SI.Torque tau "motor torque at the load";
  output SI.Angle angle = phi;
  output SI.Current current = i;
equation
  L*der(i) = u - R*i - k*n*w;
  tau = n*k*i;
  w = der(phi);
  a = der(w);
  (Jl + n^2*Jm)*a = tau - b*w - mgl*sin(phi);
end GearedMotor;
