"""The top of a report, for readers who read no further: what it is about in one sentence, and a few large numbers."""

import math
from dataclasses import dataclass

from orchestrator.compare.result import Comparison, SetErrors
from orchestrator.diagnosis.result import Diagnosis
from orchestrator.report.numbers import over_floor, percent, quantity, ratio
from orchestrator.report.sentences import WITHIN_NOISE, effect_name, errors, joined


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


def diagnosis_plain(diagnosis: Diagnosis) -> str:
    """What the verdict means, without a technical term."""
    before, after = before_after(diagnosis)
    if math.isnan(before):
        return ""
    start = f"On trials that nobody had looked at, the model as given is off by {ratio(before)} the sensors' noise"
    if not diagnosis.effects or math.isnan(after):
        return f"{start}; a perfect model would be at 1."
    them = "them" if len(diagnosis.effects) > 1 else "that"
    named = joined(effect_name(effect) for effect in diagnosis.effects)
    return f"{start}. It lacks {named}; with {them} added it is off by {ratio(after)}, where a perfect model would be at 1."


def diagnosis_facts(diagnosis: Diagnosis) -> tuple[Fact, ...]:
    """The error before and after, the share removed, and how sure it is."""
    before, after = before_after(diagnosis)
    held_out, units = diagnosis.held_out, diagnosis.steps[0].comparison.units
    facts = []
    if not math.isnan(before):
        facts.append(Fact("Error as given", ratio(before), errors(held_out.rmse_before, units), _mood(before)))
    if not math.isnan(after) and diagnosis.effects:
        facts.append(Fact("Error with the effects", ratio(after), errors(held_out.rmse_after, units), _mood(after)))
    if before > 1.0 and diagnosis.effects:
        share = percent(held_out.reducible_removed)
        facts.append(Fact("Removed", share, "of what is above the noise floor, held-out trials"))
    if diagnosis.p_value is not None:
        facts.append(Fact("Chance", f"p = {diagnosis.p_value:.2g}", "that noise alone looks like this"))
    return tuple(facts)


def before_after(diagnosis: Diagnosis) -> tuple[float, float]:
    """Held-out error of the model as given and with the effects, in noise floors; NaN where there is none."""
    found = diagnosis.held_out
    return over_floor(found.rmse_before, found.noise_floor), over_floor(found.rmse_after, found.noise_floor)


def _decisive(comparison: Comparison) -> tuple[SetErrors, str]:
    if comparison.held_out is None:
        return comparison.learning, "the trials"
    return comparison.held_out, "trials that were held out"


def _mood(times: float) -> str:
    return "good" if times <= WITHIN_NOISE else "bad"
