within FESArm.Effects;
package Tendon "Stretch of the tendons"
  annotation (Documentation(info="<html><p>What stands between a muscle and the bones that it pulls.</p></html>"));
end Tendon;
