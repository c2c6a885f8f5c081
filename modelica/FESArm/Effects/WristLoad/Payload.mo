within FESArm.Effects.WristLoad;
model Payload "Point mass carried at the wrist"
  import SI = FESArm.Units;
  extends PartialWristLoad;
  parameter SI.Mass mass(min=0) = 0.1 "Carried mass";
equation
  f = -mass*vdot;
  annotation (Documentation(info="<html>
<p>f = -mass der(v): inertia only, the plane is horizontal.</p>
<p>A point mass held at the wrist, without rotational inertia of its own. Source: Newton's law in the accelerations of
the wrist, d'Alembert's force on the arm. A level plane is assumed; a tilted one pulls at the nominal masses only.</p>
</html>"));
end Payload;
