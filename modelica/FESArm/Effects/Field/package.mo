within FESArm.Effects;
package Field "Fields that act on all masses"
  annotation (Documentation(info="<html><p>Accelerations in the plane, such as a component of gravity.</p></html>"));
end Field;
