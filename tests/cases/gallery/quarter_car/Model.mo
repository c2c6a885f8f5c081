// Quarter-car rig: wheel on a shaker, corner mass above it
model QuarterCar "Corner of a car on a road simulator"
  parameter Real ms(unit = "kg") = 310 "Sprung mass";
  parameter Real mu(unit = "kg") = 38 "Unsprung mass";
  parameter Real ks(unit = "N/m") = 21000 "Spring";
  parameter Real cs(unit = "N.s/m") = 1450 "Damper";
  parameter Real kt(unit = "N/m") = 190000 "Tyre";
  input Real zr(unit = "m") "Height of the shaker";
  output Real travel(unit = "m") "Suspension travel, positive in rebound";
  output Real height(unit = "m") "Height of the body over its rest";
  Real zs(unit = "m", start = 0), vs(unit = "m/s", start = 0) "Body";
  Real zu(unit = "m", start = 0), vu(unit = "m/s", start = 0) "Wheel";
equation
  der(zs) = vs;
  der(zu) = vu;
  // around static equilibrium, so no weight
  ms * der(vs) = -ks * (zs - zu) - cs * (vs - vu);
  mu * der(vu) = ks * (zs - zu) + cs * (vs - vu) - kt * (zu - zr);
  travel = zs - zu;
  height = zs;
end QuarterCar;
