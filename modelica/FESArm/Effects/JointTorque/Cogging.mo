within FESArm.Effects.JointTorque;
model Cogging "Torque that repeats with the position of the joint"
  import SI = FESArm.Units;
  extends PartialJointTorque;
  parameter SI.Torque sine[n] = fill(0.05, n) "Amplitude of the sine";
  parameter SI.Torque cosine[n] = fill(0, n) "Amplitude of the cosine";
  parameter SI.Factor periods(min=2, max=60) = 12 "Waves over one turn, divided by 2 pi: rad of phase per rad of joint";
equation
  for i in 1:n loop
    tau[i] = sine[i]*sin(periods*q[i]) + cosine[i]*cos(periods*q[i]);
  end for;
  annotation (Documentation(info="<html>
<p>tau = sine sin(N q) + cosine cos(N q), with N = periods for all joints.</p>
<p>It gives and takes the same energy over a period: a conservative torque. Higher harmonics are left out. Source:
Fourier's first harmonic of the cogging torque of permanent-magnet machines, for example Gieras, Permanent Magnet
Motor Technology (2009).</p>
</html>"));
end Cogging;
