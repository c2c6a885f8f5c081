within FESArm.Effects;
package Force "Forces along a straight line"
  annotation (Documentation(info="<html><p>Forces on a body that slides: the laws of <code>JointTorque</code> in N, m and m/s.</p></html>"));
end Force;
