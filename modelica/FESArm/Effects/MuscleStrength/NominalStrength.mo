within FESArm.Effects.MuscleStrength;
model NominalStrength "Absent effect: every muscle has its nominal strength"
  extends PartialMuscleStrength(present=false);
equation
  strength = ones(n);
end NominalStrength;
