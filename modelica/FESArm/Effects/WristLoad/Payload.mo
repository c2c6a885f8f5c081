within FESArm.Effects.WristLoad;
model Payload "Point mass carried at the wrist"
  import SI = FESArm.Units;
  extends PartialWristLoad;
  parameter SI.Mass mass(min=0, max=5) = 0.1 "Carried mass";
equation
  f = -mass*vdot;
  annotation (Documentation(info="<html><p>f = -mass der(v): inertia only, the plane is horizontal.</p></html>"));
end Payload;
