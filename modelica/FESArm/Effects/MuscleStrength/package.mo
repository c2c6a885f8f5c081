within FESArm.Effects;
package MuscleStrength "Strength of the muscles"
  annotation (Documentation(info="<html><p>Factors on the active force of each muscle.</p></html>"));
end MuscleStrength;
