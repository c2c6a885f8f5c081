within FESArm.Effects.StimulationPath;
model Crosstalk "A share of one channel's command reaches another muscle"
  import SI = FESArm.Units;
  extends PartialStimulationPath;
  parameter SI.Factor gain[n, n](each min=-0.2, each max=1) = zeros(n, n) "Share of channel i that reaches muscle j";
protected
  SI.Factor sent[n] "What reaches each muscle";
equation
  sent = u + transpose(gain)*u;
  for j in 1:n loop
    y[j] = noEvent(min(1, sent[j]));
  end for;
  annotation (Documentation(info="<html>
<p>y_j = u_j + sum_i gain_ij u_i, at most 1.</p>
<p>The current of one electrode recruits another muscle in proportion, and shares add up. Negative shares stand for
inhibition. Derived here: the first-order term of a mixing matrix I + gain'.</p>
</html>"));
end Crosstalk;
