block Buck "Averaged step-down converter"
  parameter Real L(final unit = "H") = 47e-6 "inductor" annotation(Dialog(group="power stage"));
  parameter Real C(final unit = "F") = 220e-6 "output capacitor";
  parameter Real rL(final unit = "Ohm") = 0.045 "winding";
  parameter Real Rload(final unit = "Ohm") = 2.2;
  input Real d(min = 0, max = 1) "duty cycle";
  input Real Vin(final unit = "V", start = 24);
  output Real v(final unit = "V", start = 0) "output voltage";
  output Real i(final unit = "A", start = 0) "inductor current";
equation
  L*der(i) = d*Vin - rL*i - v "mesh";
  C*der(v) = i - v/Rload "node";
  annotation(experiment(StopTime = 0.004));
end Buck;
