within FESArm;
package Examples "Short scenes for people"
  annotation (Documentation(info="<html><p>Each shows one thing; the description names the variable to look at.</p></html>"));
end Examples;
