within FESArm;
package Units "SI types of this library, so that it needs no other library"
  type Angle = Real(final quantity="Angle", final unit="rad");
  type AngularVelocity = Real(final quantity="AngularVelocity", final unit="rad/s");
  type AngularAcceleration = Real(final quantity="AngularAcceleration", final unit="rad/s2");
  type Length = Real(final quantity="Length", final unit="m");
  type Velocity = Real(final quantity="Velocity", final unit="m/s");
  type Acceleration = Real(final quantity="Acceleration", final unit="m/s2");
  type Mass = Real(final quantity="Mass", final unit="kg", min=0);
  type Inertia = Real(final quantity="MomentOfInertia", final unit="kg.m2", min=0);
  type Force = Real(final quantity="Force", final unit="N");
  type Torque = Real(final quantity="Torque", final unit="N.m");
  type RotationalDamping = Real(final quantity="RotationalDampingConstant", final unit="N.m.s/rad");
  type QuadraticStiffness = Real(final unit="N/m2") "Force over squared stretch";
  type Time = Real(final quantity="Time", final unit="s");
  type Fraction = Real(final unit="1", min=0, max=1) "Share of a full value";
  type Factor = Real(final unit="1") "Ratio to a nominal value";
  annotation (Documentation(info="<html><p>The subset of <code>Modelica.Units.SI</code> that is used here.</p></html>"));
end Units;
