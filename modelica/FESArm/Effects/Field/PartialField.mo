within FESArm.Effects.Field;
partial model PartialField "Contract: acceleration that acts on all masses"
  import SI = FESArm.Units;
  parameter Boolean present = true "False in the absent effect only";
  output SI.Acceleration g[2] "Field in the plane, world axes";
end PartialField;
