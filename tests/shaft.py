"""The model of an inertia under a torque, as a Modelica file that tests of several rooms write."""

SHAFT = """model Shaft "An inertia under a torque"
  parameter Real J(unit="kg.m2") = 0.02;
  input Real torque(unit="N.m");
  output Real phi(unit="rad", start=0, fixed=true);
  Real w(unit="rad/s", start=0, fixed=true);
equation
  der(phi) = w;
  J*der(w) = torque;
end Shaft;
"""
