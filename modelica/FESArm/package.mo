within ;
package FESArm "A planar arm driven by stimulated muscles, and the effects that its simple model leaves out"
  annotation (Documentation(info="<html>
<p>Two links in a horizontal plane, six Hill muscles, and exchangeable effects. A model offers <em>slots</em>: replaceable
components such as <code>jointTorque1</code>, which hold an absent effect (for example
<code>Effects.JointTorque.NoJointTorque</code>) until another class of the same contract is redeclared into them.</p>
<p>Inputs named <code>correction_*</code> are generalised forces that act beside the model's own; they are zero in the
nominal model and serve to ask which force is missing.</p>
</html>"));
end FESArm;
