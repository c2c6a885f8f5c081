within FESArm.Effects.MuscleStrength;
model NominalStrength "Absent effect: every muscle has its nominal strength"
  extends PartialMuscleStrength(present=false);
equation
  strength = ones(n);
  annotation (Documentation(info="<html><p>strength = 1 for every muscle.</p></html>"));
end NominalStrength;
