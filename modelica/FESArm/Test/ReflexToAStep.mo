within FESArm.Test;
model ReflexToAStep "The reflex answers a sudden lengthening late and smoothly, a shortening not at all"
  FESArm.Effects.Reflex.StretchReflex reflex(n=2, gain=0.1, delay=0.04);
  output Real answerError(unit="1"), silenceError(unit="1") "Zero when the law is right";
equation
  reflex.v = {1.5, -1.5};
  answerError = reflex.added[1] - 0.15*(1 - (1 + 50*time)*exp(-50*time));
  silenceError = reflex.added[2];
  annotation (experiment(StopTime=0.3), Documentation(info="<html>
<p>Two lags of half the delay, one after the other, answer a step with 1 - (1 + t/T) exp(-t/T), T = 0.02 s.</p></html>"));
end ReflexToAStep;
