within FESArm.Effects.Field;
model GravityTilt "The plane is not level: a constant field in it"
  import SI = FESArm.Units;
  extends PartialField;
  parameter SI.Acceleration gx = 0.01 "Component along world x";
  parameter SI.Acceleration gy = 0.01 "Component along world y";
equation
  g = {gx, gy};
  annotation (Documentation(info="<html>
<p>The tilt is asin(sqrt(gx^2 + gy^2)/9.81), the field points in the direction atan2(gy, gx).</p>
<p>g = (gx, gy) on every mass, weight being g times the mass at each centre of mass. The tilt is small enough that
inertias stay those of the plane, and it does not change within a run. Derived here from gravity's components in an
inclined plane.</p>
</html>"));
end GravityTilt;
