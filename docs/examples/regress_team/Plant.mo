package Plant "What the team of the example works on"
  model Motor "DC motor with a fan"
    parameter Real R(unit = "Ohm") = 2.0 "Resistance of the winding";
    parameter Real L(unit = "H") = 0.01 "Inductance of the winding";
    parameter Real k(unit = "N.m/A") = 0.05 "Torque for each ampere, and voltage for each rad/s";
    parameter Real J(unit = "kg.m2") = 2e-4 "Inertia of rotor and fan";
    parameter Real d(unit = "N.m.s/rad") = 1e-4 "Drag of the fan";
    input Real u(unit = "V", start = 0) "Voltage";
    output Real w(unit = "rad/s", start = 0, fixed = true, nominal = 100) "Speed";
    output Real i(unit = "A", start = 0, fixed = true) "Current";
  equation
    L*der(i) = u - R*i - k*w;
    J*der(w) = k*i - d*w;
  end Motor;

  model Tank "Tank that empties through a hole"
    parameter Real A(unit = "m2") = 0.5 "Area of the surface";
    parameter Real a(unit = "m2") = 2e-3 "Area of the hole";
    input Real inflow(unit = "m3/s", start = 0) "Flow into the tank";
    output Real h(unit = "m", start = 0.5, fixed = true) "Level";
    output Real outflow(unit = "m3/s") "Flow through the hole";
  equation
    outflow = a*sqrt(2*9.81*max(h, 0));
    A*der(h) = inflow - outflow;
  end Tank;

  model Room "Room that a heater warms"
    parameter Real C(unit = "J/K") = 5e4 "Heat capacity of the air";
    parameter Real G(unit = "W/K") = 20 "Conductance of the walls";
    parameter Real outside(unit = "K") = 273.15 "Temperature outside";
    input Real heating(unit = "W", start = 0) "Power of the heater";
    output Real T(unit = "K", start = 290, fixed = true, nominal = 300) "Temperature";
  equation
    C*der(T) = heating - G*(T - outside);
  end Room;
end Plant;
