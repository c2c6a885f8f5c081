within FESArm;
package Effects "What a simple model leaves out"
  annotation (Documentation(info="<html><p>One folder for each contract: the partial contract, the absent effect, and one class for each law.</p></html>"));
end Effects;
