within FESArm.Effects.Tendon;
model RigidTendon "Absent effect: tendons do not stretch"
  extends PartialTendon(present=false);
equation
  Lfree = L;
  Vfree = V;
  F = Frigid;
  annotation (Documentation(info="<html>
<p>The muscle has the whole path, and its force is the one on the bones: Lfree = L, Vfree = V, F = Frigid.</p></html>"));
end RigidTendon;
