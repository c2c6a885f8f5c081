within FESArm.Effects;
package MomentArm "Errors of the moment arms"
  annotation (Documentation(info="<html><p>Factors on the moment arms of each muscle, in torque and in length.</p></html>"));
end MomentArm;
