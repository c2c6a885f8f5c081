"""Results in plain words: what was found, before any table or figure."""

from collections.abc import Mapping, Sequence
from typing import Any

from orchestrator.compare.estimates import WITHIN_NOISE
from orchestrator.compare.result import Comparison
from orchestrator.ledger import LedgerEntry, newest
from orchestrator.report.answer.answer import answer_of
from orchestrator.report.answer.words import joined, name_of, what
from orchestrator.report.numbers import percent, quantity, ratio
from orchestrator.verdicts.result import Diagnosis, NamedEffect, RankedSet

# Effects of a version that a table lists.
MOST_LISTED = 4


def effect_name(effect: NamedEffect) -> str:
    """Return an effect and its site as words.

    Example:
        >>> effect_name(NamedEffect("coulomb_friction", "joint1", {}))
        'Coulomb friction at joint1'
    """
    return what({"id": effect.id, "site": effect.site, "variant": effect.variant})


def most_of(effects: Sequence[NamedEffect]) -> tuple[Sequence[NamedEffect], str]:
    """The effects that a table lists, and a line for those that it does not: a model may have many fitted parameters."""
    left = len(effects) - MOST_LISTED
    return (effects, "") if left <= 1 else (effects[:MOST_LISTED], f"and {left} others")


def ranked_name(entry: RankedSet) -> str:
    """Return the effects of a ranked set as words; the empty set is the model as it is."""
    if not entry.effects:
        return "nothing added"
    sites = entry.sites if len(entry.effects) == len(entry.sites) else ("",) * len(entry.effects)
    return " + ".join(what({"id": effect, "site": site}) for effect, site in zip(entry.effects, sites, strict=True))


def errors(rmse: Mapping[str, float], units: Mapping[str, str]) -> str:
    """Return root mean square errors by signal, such as `q1 41.2 mrad, q2 9.31 mrad`."""
    return ", ".join(f"{name} {quantity(value, units.get(name, ''))}" for name, value in rmse.items())


def comparison_sentence(comparison: Comparison) -> str:
    """Return what a comparison says about the model; learning and held-out trials weigh alike.

    The verdict is that of the held-out trials unless the learning trials alone are not explained; the error on the others stands
    beside it.
    """
    sets = {"learning": comparison.learning}
    if comparison.held_out is not None:
        sets = {"held-out": comparison.held_out, **sets}
    unexplained = [name for name, found in sets.items() if found.over_floor > WITHIN_NOISE]
    trials = (unexplained or list(sets))[0]
    found = sets.pop(trials)
    if unexplained:
        opening = f"The model does not explain the {trials} trials"
    else:
        opening = f"The model agrees with the {trials} trials within the noise"
    text = f"{opening}: its error is {ratio(found.over_floor)} the noise floor ({errors(found.rmse, comparison.units)})"
    others = "".join(f", {ratio(other.over_floor)} on the {name} trials" for name, other in sets.items())
    return f"{text}{others}{'' if unexplained else _worst(comparison)}."


def _worst(comparison: Comparison) -> str:
    """The signal of one trial that the model does not explain although all signals of all trials together are."""
    floor = comparison.noise_floor
    times = [(each.rmse[n] / floor[n], n, each.file) for each in comparison.trials for n in each.rmse if floor[n]]
    worst, signal, file = max(times, default=(0.0, "", ""))
    return f"; but {signal} of {file} is off by {ratio(worst)} it" if worst > WITHIN_NOISE else ""


def ledger_sentence(entries: Sequence[LedgerEntry]) -> str:
    """Return what became of a model from its first to its newest version along the newest version's measurements."""
    if not entries:
        return "There is no version yet."
    entries = newest(entries)
    errors_now = [(entry.held_out or entry.learning).over_floor for entry in (entries[0], entries[-1])]
    if len(entries) == 1:
        return f"The model as given is off by {ratio(errors_now[0])} the noise floor; there is no other version yet."
    trials = "learning" if entries[-1].held_out is None else "held-out"
    added = joined(effect_name(effect) for effect in entries[-1].effects)
    return (
        f"From {entries[0].name} to {entries[-1].name} the error on {trials} trials went from {ratio(errors_now[0])} to "
        f"{ratio(errors_now[1])} the noise floor{f', with {added}' if added else ''}."
    )


def verdict_sentence(diagnosis: Diagnosis) -> str:
    """Return the answer in plain sentences: what is missing and where, its size, what adding it buys."""
    return answer_of(diagnosis.to_json()).text


def experiment_sentence(experiment: Mapping[str, Any], said: str = "") -> str:
    """Return what to do next unless it was `said` already, and what is expected of it as far as that was computed."""
    do = str(experiment.get("do", experiment.get("experiment", "")))
    if do.startswith("no "):
        return "" if do[1:] in said else f"{do[:1].upper()}{do[1:]}."
    text = "" if do in said else f"Next experiment: {do}. "
    if "probability_to_separate" not in experiment:
        return text.strip()
    chance, gain = experiment["probability_to_separate"], experiment["expected_gain"]
    apart = joined(name_of(name) for name in experiment["effects"])
    better = f"; a repetition would separate them {ratio(gain)} less" if gain > 1 else ""
    it = "It" if text else "That experiment"
    return f"{text}{it} tells apart {apart} with a probability of {percent(chance)}{better}."
