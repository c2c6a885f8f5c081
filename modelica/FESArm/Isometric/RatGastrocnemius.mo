within FESArm.Isometric;
model RatGastrocnemius "Rat gastrocnemius medialis with published parameters"
  extends IsometricMuscle(
    Fmax = 15.5,
    Lopt = 0.0137,
    kSeries = 9.52e5,
    Lslack = 0.0288,
    kParallel = 2.87e4,
    Lparallel = 0.0151);
  annotation (Documentation(info="<html>
<p>Rat GMe1 of Reuvers et al., Accuracy of Experimentally Estimated Muscle Properties (improved method). The stiffnesses
are given in N/m2: the article's column reads N/mm2, but only 0.952 N/mm2 agrees with the passive force of 0.2 N and with
a tendon stretch of 3 mm at 11 N.</p>
</html>"));
end RatGastrocnemius;
