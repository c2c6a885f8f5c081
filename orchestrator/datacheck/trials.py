"""A trial unlike the others, and clocks of inputs and outputs that do not agree."""

from collections.abc import Callable, Iterator, Mapping
from dataclasses import replace

import numpy as np

from orchestrator.datacheck import limits
from orchestrator.datacheck.columns import wrong_columns
from orchestrator.datacheck.findings import NO_CHANGE, Change, Finding
from orchestrator.datacheck.prediction import Predictor
from orchestrator.measurements import BoundSet, BoundTrial
from orchestrator.models.contract import Model

# Lags in samples that are tried before the best one is refined, to this share of a sample at least.
LAGS, FINEST = (2, 8, 32), 0.05
# Stretches of a trial that are looked at to judge it, and its clocks.
FOR_ONE, FOR_LAGS = 2, 2
# Fewer trials than this have no way that trials usually are.
SEVERAL = 3


def odd_trials(model: Model, data: BoundSet, units: Mapping[str, str]) -> Iterator[Finding]:
    """Trials of which the model leaves far more than of the learning ones, with the column that explains it, if one does."""
    own = {trial.name: Predictor(model, data, (trial,), FOR_ONE) for trial in data.trials}
    left = {name: each.left() for name, each in own.items()}
    error = {name: each.errors() for name, each in own.items()}
    usual = [left[trial.name] for trial in data.learning]
    if len(usual) < SEVERAL:
        return
    for trial in data.trials:
        rest = [each.name for each in data.learning if each is not trial]
        others = float(np.median([left[name] for name in rest]))
        if left[trial.name] < max(limits.STANDS_OUT * others, limits.WELL_PREDICTED) or others > limits.WELL_PREDICTED:
            continue
        usual_error = np.median([error[name] for name in rest], axis=0)
        if np.all(error[trial.name] < limits.LARGER * usual_error):
            continue  # it shows less than the others, and leaves as much
        learns = trial.subset == "learning"
        found = wrong_columns(own[trial.name], units)
        for finding in found:
            yield replace(finding, trial=trial.name, trials=(trial.name,), strong=learns)
        if not found:
            evidence = (
                f"over short stretches the model leaves {left[trial.name]:.3g} of what this trial shows, and {others:.2g} of the"
                " others"
            )
            yield Finding("trial", "", trial.name, evidence, "look at it, or leave it out", strong=False)


def clock_lags(model: Model, data: BoundSet) -> Iterator[Finding]:
    """Inputs that are recorded late or early against the outputs, in all learning trials or in single ones.

    Outputs that answer before their input are a clock's fault; where friction cannot be tried as the cause, only if the model is
    as good as the noise with the inputs moved. Outputs that answer late may be a plant with a delay, so that this is told but forbids
    nothing, unless one trial differs from the others.
    """
    whole = Predictor(model, data, data.learning)
    inputs = tuple(name for name in whole.moving if name in data.input_names)
    if not inputs:
        return
    steps = {trial.name: float(np.median(np.diff(trial.time))) for trial in data.trials}
    found: dict[str, tuple[float, float, float]] = {}
    for trial in data.trials:
        lag_of_trial = _lag(Predictor(model, data, (trial,), FOR_LAGS), inputs, steps[trial.name])
        if lag_of_trial is not None:
            found[trial.name] = lag_of_trial
    known = [trial.name for trial in data.learning if trial.name in found]
    if 2 * len(known) < len(data.learning):
        return
    lags = [found[name][0] for name in known]
    common = float(np.median(lags))
    column = ", ".join(inputs)
    spread = max(1.0, limits.DELAY_SPREAD * abs(common))
    alike = sum(abs(lag - common) <= spread for lag in lags)
    if alike < len(lags) - 1:
        return
    if abs(common) > limits.DELAY_SAMPLES:
        before, after = (float(np.median([found[name][k] for name in known])) for k in (1, 2))
        step = steps[data.learning[0].name]
        change = Change("delay", inputs, common * step, "")
        yield Finding(
            "delay",
            column,
            "",
            f"outputs answer {abs(common * step):.4g} s {'before' if common < 0 else 'after'} their inputs:"
            f" over short stretches the model leaves {before:.2g} of what the record shows, and {after:.2g} with inputs moved",
            _moved(column, common * step) + ("" if common < 0 else ", unless the plant has a delay"),
            strong=common < 0 and (whole.can_be_pushed or whole.reaches_noise(change)),
            change=change,
        )
    for trial in data.trials:
        lag, _, after = found.get(trial.name, (common, 0.0, 0.0))
        if len(lags) < SEVERAL or abs(lag - common) <= limits.DELAY_SAMPLES + spread:
            continue
        as_others = Change("delay", inputs, common * steps[trial.name], "")
        before = Predictor(model, data, (trial,), FOR_LAGS).left(as_others)
        if before < limits.DELAY_DROP * after:
            continue  # the lag of the others does nearly as well
        others = [each for each in data.learning if each is not trial and each.name in found]
        if 2 * sum(_gains(model, data, each, inputs, lag, common, steps) for each in others) > len(others):
            continue  # a sensor that answers late in every trial, shown well enough by this one
        seconds = (lag - common) * steps[trial.name]
        yield Finding(
            "delay",
            column,
            trial.name,
            f"inputs and outputs of this trial are {abs(seconds):.4g} s further apart than in the others: the model leaves"
            f" {before:.2g} of what it shows, and {after:.2g} with inputs moved",
            _moved(column, seconds),
            strong=trial.subset == "learning",
            change=Change("delay", inputs, seconds, ""),
            trials=(trial.name,),
        )


def _gains(
    model: Model,
    data: BoundSet,
    trial: BoundTrial,
    inputs: tuple[str, ...],
    lag: float,
    common: float,
    steps: Mapping[str, float],
) -> bool:
    """Whether a trial, too, is predicted better with inputs moved by `lag` samples than by the common lag."""
    predictor = Predictor(model, data, (trial,), FOR_LAGS)
    moved, usual = (Change("delay", inputs, samples * steps[trial.name], "") for samples in (lag, common))
    return predictor.left(moved) < predictor.left(usual)


def _moved(column: str, seconds: float) -> str:
    return f"read {column} {abs(seconds):.4g} s {'later' if seconds > 0 else 'earlier'}"


def _lag(predictor: Predictor, inputs: tuple[str, ...], step: float) -> tuple[float, float, float] | None:
    """Samples by which inputs come too early, and what the model leaves without and with them moved; None if nobody knows.

    Friction that a model lacks makes outputs lead, too, so a lead counts only if it is one beside free pushes as well.
    """
    as_given = predictor.left()
    if as_given < limits.EXACT:
        return 0.0, as_given, as_given
    lacks = as_given > limits.WELL_PREDICTED
    found = None if lacks and predictor.can_be_pushed else _lag_by(predictor.left, inputs, step)
    pushes_tell = predictor.can_be_pushed and (lacks or (found is not None and found[0] < 0.0))
    return _lag_by(predictor.left_when_pushed, inputs, step) if pushes_tell else found


def _lag_by(
    left_with: Callable[[Change], float], inputs: tuple[str, ...], step: float
) -> tuple[float, float, float] | None:
    def left(samples: float) -> float:
        return left_with(Change("delay", inputs, samples * step, ""))

    before = left_with(NO_CHANGE)
    tried = {lag: left(lag) for lag in (-2.0, 2.0)} | {0.0: before}
    if before > min(tried.values()):
        tried |= {float(sign * lag): left(sign * lag) for lag in LAGS for sign in (-1, 1)}
    best = min(tried, key=lambda lag: tried[lag])
    reach = max(1.0, 0.5 * abs(best)) if tried[best] <= limits.DELAY_HINT * before else 0.0
    while best != 0.0 and reach > FINEST:
        for lag in (best - reach, best + reach):
            tried.setdefault(lag, left(lag))
        best = min(tried, key=lambda lag: tried[lag])
        reach *= 0.5
    after = tried[best]
    if after > limits.WELL_PREDICTED:
        return None
    return (best, before, after) if before > limits.DELAY_DROP * after else (0.0, before, before)
