"""The top of a report, for readers who read no further: what it is about in one sentence, and a few large numbers."""

import math
from dataclasses import dataclass

from orchestrator.compare.estimates import WITHIN_NOISE
from orchestrator.compare.result import Comparison, SetErrors
from orchestrator.report.numbers import quantity, ratio


@dataclass(frozen=True)
class Fact:
    """One number or name, in large type: what it is, itself, and what it rests on. `mood` is "good", "bad" or ""."""

    name: str
    value: str
    note: str = ""
    mood: str = ""


def comparison_plain(comparison: Comparison) -> str:
    """What the error means, without a technical term."""
    found, trials = _decisive(comparison)
    if not math.isfinite(found.over_floor):
        return f"On {trials} the model leaves the measurement altogether."
    return (
        f"On {trials} the model misses the measurement by {ratio(found.over_floor)} what the sensors' noise alone "
        f"explains; a perfect model would be at 1."
    )


def comparison_facts(comparison: Comparison) -> tuple[Fact, ...]:
    """The error, the signal that is worst, and the floor."""
    found, trials = _decisive(comparison)
    floor = comparison.noise_floor
    worst = max(found.rmse, key=lambda name: found.rmse[name] / floor[name] if floor[name] else math.inf)
    unit = comparison.units[worst]
    return (
        Fact("Error", ratio(found.over_floor), f"the noise floor, rms over signals, {trials}", _mood(found.over_floor)),
        Fact(f"Worst signal: {worst}", quantity(found.rmse[worst], unit), f"rms; noise {quantity(floor[worst], unit)}"),
        Fact("Trials", str(len(comparison.trials)), f"{sum(t.set == 'held_out' for t in comparison.trials)} held out"),
    )


def _decisive(comparison: Comparison) -> tuple[SetErrors, str]:
    if comparison.held_out is None:
        return comparison.learning, "the trials"
    return comparison.held_out, "trials that were held out"


def _mood(times: float) -> str:
    return "good" if times <= WITHIN_NOISE else "bad"
