model Reactor "Cooled stirred tank, first-order exothermic reaction A -> B"
  parameter Real V(unit="m3") = 0.1 "volume";
  parameter Real rhocp(unit="J/(m3.K)") = 4.1e6;
  parameter Real k0(unit="1/s") = 7.2e10/60;
  parameter Real EoR(unit="K") = 8750;
  parameter Real dH(unit="J/mol") = -5e4;
  parameter Real UA(unit="W/K") = 5200 "jacket";
  parameter Real cf(unit="mol/m3") = 1000 "feed";
  parameter Real Tf(unit="K") = 340;
  input Real q(unit="m3/s", start=1.4e-3) "feed flow";
  input Real Tj(unit="K", start=305) "jacket temperature";
  output Real T(unit="K", start=347);
  output Real cA(unit="mol/m3", start=600);
  Real r(unit="mol/(m3.s)") "rate of reaction";
equation
  r = k0*exp(-EoR/T)*cA;
  V*der(cA) = q*(cf - cA) - V*r;
  /* energy balance:
     feed, reaction, jacket */
  V*rhocp*der(T) = q*rhocp*(Tf - T)
                   - dH*V*r
                   + UA*(Tj - T);
end Reactor;
