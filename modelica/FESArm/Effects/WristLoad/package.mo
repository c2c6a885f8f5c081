within FESArm.Effects;
package WristLoad "Loads carried at the wrist"
  annotation (Documentation(info="<html><p>Laws of force at the wrist as a function of its motion.</p></html>"));
end WristLoad;
