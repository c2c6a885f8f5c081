within FESArm;
package Linkage "Rigid bodies"
  annotation (Documentation(info="<html><p>Motion of the links under joint torques and a force at the wrist.</p></html>"));
end Linkage;
