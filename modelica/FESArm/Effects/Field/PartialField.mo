within FESArm.Effects.Field;
partial model PartialField "Contract: acceleration that acts on all masses"
  import SI = FESArm.Units;
  parameter Boolean present = true "False in the absent effect only";
  output SI.Acceleration g[2] "Field in the plane, world axes";
  annotation (Documentation(info="<html>
<p>The field g acts on every mass: force m g at each centre of mass. Uniform in space; an effect may let it change
with time. The sign is that of weight, so a plane whose +x side is lower has gx &gt; 0. Contract of this project.</p>
</html>"));
end PartialField;
