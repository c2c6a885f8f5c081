within FESArm.Effects;
package Inflow "Errors of a pump"
  annotation (Documentation(info="<html><p>What arrives against what was commanded.</p></html>"));
end Inflow;
