within FESArm.Test;
model TremorShakesAnInertia "Periodic torque on a free inertia: the angle is a line with a sine on it"
  import SI = FESArm.Units;
  parameter SI.Inertia J = 0.1 "Inertia";
  FESArm.Effects.JointTorque.Tremor tremor(n=1, amplitude={0.3}, frequency=4);
  SI.Angle q(start=0, fixed=true) "Angle";
  SI.AngularVelocity w(start=0, fixed=true) "Speed";
  output SI.Angle qError "Zero when the law is right";
protected
  constant Real omega(unit="rad/s") = 8*3.14159265358979323846 "Angular frequency";
equation
  der(q) = w;
  tremor.q = {q};
  tremor.w = {w};
  tremor.a = {der(w)};
  J*der(w) = tremor.tau[1];
  qError = q - 0.3/(J*omega)*(time - sin(omega*time)/omega);
  annotation (experiment(StopTime=1), Documentation(info="<html>
<p>The phase starts at zero: J der(w) = A sin(omega t).</p></html>"));
end TremorShakesAnInertia;
