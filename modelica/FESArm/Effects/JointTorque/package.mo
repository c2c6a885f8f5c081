within FESArm.Effects;
package JointTorque "Torques that act at the joints"
  annotation (Documentation(info="<html><p>Laws of joint torque as a function of joint angle and speed.</p></html>"));
end JointTorque;
