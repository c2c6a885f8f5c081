within FESArm.Effects;
package TankFlow "Flows out of tanks that a model lacks"
  annotation (Documentation(info="<html><p>Valves that are off and leaks.</p></html>"));
end TankFlow;
