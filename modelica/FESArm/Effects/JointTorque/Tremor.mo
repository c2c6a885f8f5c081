within FESArm.Effects.JointTorque;
model Tremor "Periodic torque of one frequency at the joints"
  import SI = FESArm.Units;
  extends PartialJointTorque;
  parameter SI.Torque amplitude[n] = fill(0.05, n) "Amplitude";
  parameter SI.Frequency frequency(min=0.01, max=1000) = 4 "Frequency";
  Real phase[2](each unit="1", start={0, 1}, each fixed=true, each min=-6, each max=6)
    "Sine and cosine of the phase, times a length that counts for nothing";
protected
  constant Real tiny(unit="1") = 1e-20 "Keeps a phase of length zero from dividing by it";
  constant SI.Factor pi = 3.14159265358979323846 "Half a turn in rad";
equation
  der(phase[1]) = 2*pi*frequency*phase[2];
  der(phase[2]) = -2*pi*frequency*phase[1];
  for i in 1:n loop
    tau[i] = amplitude[i]*phase[1]/sqrt(phase[1]^2 + phase[2]^2 + tiny);
  end for;
  annotation (Documentation(info="<html>
<p>tau = amplitude sin(2 pi frequency t + phase), as an oscillator whose start values carry the phase of a trial.</p>
<p>d/dt (sine, cosine) = 2 pi frequency (cosine, -sine), whose length never changes, and by which the torque is divided: of
two numbers that only their product shows neither would be known. The limits are wide, so that a fit may turn the phase all the
way at little cost. One frequency for both joints, in phase or against each other. Derived here; a measured tremor wanders in
amplitude and frequency (Elble and Koller, Tremor, 1990).</p>
</html>"));
end Tremor;
