within FESArm.Test;
model CoggingKeepsEnergy "Cogging gives back what it takes: motion over the waves keeps its energy"
  import SI = FESArm.Units;
  parameter SI.Inertia J = 0.1 "Inertia";
  FESArm.Effects.JointTorque.Cogging cogging(n=1, sine={0.3}, cosine={0.2}, periods=7);
  SI.Angle q(start=0.1, fixed=true) "Angle";
  SI.AngularVelocity w(start=2, fixed=true) "Speed";
  output Real energyError(unit="J") "Zero when the law is right";
equation
  der(q) = w;
  cogging.q = {q};
  cogging.w = {w};
  cogging.a = {der(w)};
  J*der(w) = cogging.tau[1];
  energyError = J*(w^2 - 4)/2 + (0.3*(cos(7*q) - cos(0.7)) - 0.2*(sin(7*q) - sin(0.7)))/7;
  annotation (experiment(StopTime=2), Documentation(info="<html>
<p>The potential of s sin(p q) + c cos(p q) is (s cos(p q) - c sin(p q))/p.</p></html>"));
end CoggingKeepsEnergy;
