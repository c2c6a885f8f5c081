within FESArm.Effects;
package Reflex "Activation that the muscles' own motion adds"
  annotation (Documentation(info="<html><p>Laws of added activation as a function of how fast a muscle lengthens.</p></html>"));
end Reflex;
