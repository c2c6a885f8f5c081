within FESArm;
package Isometric "Muscles held at a given length"
  annotation (Documentation(info="<html><p>Force of a stimulated muscle whose length is imposed.</p></html>"));
end Isometric;
