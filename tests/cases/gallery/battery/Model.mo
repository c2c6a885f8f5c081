model Cell "18650 cell: open-circuit voltage, ohmic drop, one RC"
  // capacity is nominal, from the data sheet
  parameter Real Q(unit="A.s") = 9000;
  parameter Real R0(unit="Ohm") = 0.031, R1(unit="Ohm") = 0.019;
  parameter Real C1(unit="F") = 1350;
  input Real I(unit="A") "load current, positive in discharge";
  Real soc(start=0.9) "state of charge";
  Real U1(unit="V", start=0) "polarisation";
  Real ocv(unit="V");
  output Real U(unit="V") "terminal voltage";
equation
  der(soc) = -I/Q;
  der(U1) = I/C1 - U1/(R1*C1);
  ocv = 3.05 + 1.55*soc - 1.15*soc^2 + 0.72*soc^3 - 0.12*exp(-35*soc);
  U = ocv - R0*I - U1;
end Cell;
