within FESArm.Effects.JointTorque;
model StribeckFriction "Coulomb friction with a breakaway part that fades with speed"
  import SI = FESArm.Units;
  extends PartialJointTorque;
  parameter SI.Torque tauC[n](each min=0) = fill(0.05, n) "Friction torque at speed";
  parameter SI.Torque tauExtra[n](each min=0) = fill(0.05, n) "Extra torque near rest";
  parameter SI.AngularVelocity vS(min=0.01, max=3) = 0.2 "Speed at which the extra part has fallen to 37 %";
  parameter SI.AngularVelocity wSharp(min=1e-4) = 0.002 "Speed at which 76 % of the full torque is reached";
equation
  for i in 1:n loop
    tau[i] = -(tauC[i] + tauExtra[i]*exp(-(w[i]/vS)^2))*tanh(w[i]/wSharp);
  end for;
  annotation (Documentation(info="<html>
<p>tau = -(tauC + tauExtra exp(-(w/vS)^2)) tanh(w/wSharp), smooth by construction; see CoulombFriction for its limit
at rest.</p>
<p>The extra part falls like a Gaussian. Source: Armstrong-Helouvry, Dupont, Canudas de Wit, A survey of models,
analysis tools and compensation methods for the control of machines with friction, Automatica 30 (1994), without its
memory and its rising static part.</p>
</html>"));
end StribeckFriction;
