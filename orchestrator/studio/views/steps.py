"""The error, version after version, as it falls towards the noise floor: what the picture shows, without any page."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

from orchestrator.ledger import LedgerEntry
from orchestrator.report.numbers import digits
from orchestrator.report.sentences import effect_name, errors


@dataclass(frozen=True)
class Step:
    """One version: what was added to the one before, and its errors as multiples of the noise floor.

    `decisive` is the error on held-out trials where there are any, else that on learning trials. Errors of signals are
    in words.
    """

    version: int
    name: str
    added: str
    learning: float
    held_out: float | None
    signals: str

    @property
    def decisive(self) -> float:
        """The error that counts."""
        return self.learning if self.held_out is None else self.held_out


def steps_of(entries: Sequence[LedgerEntry]) -> tuple[Step, ...]:
    """The versions of a ledger, in its order."""
    found, known = [], set[str]()
    for entry in entries:
        names = [effect_name(effect) for effect in entry.effects]
        added = [name for name in names if name not in known]
        known = set(names)
        decisive = entry.learning if entry.held_out is None else entry.held_out
        found.append(
            Step(
                entry.version,
                entry.name,
                " + ".join(added) or ("as given" if entry.version == 0 else "the same effects, fitted again"),
                entry.learning.over_floor,
                None if entry.held_out is None else entry.held_out.over_floor,
                errors(decisive.rmse, entry.units),
            )
        )
    return tuple(found)


def summary(steps: Sequence[Step]) -> str:
    """The picture in a sentence."""
    if not steps:
        return "No version has been recorded yet."
    first, last = steps[0], steps[-1]
    trials = "learning" if last.held_out is None else "held-out"
    if len(steps) == 1:
        return f"The model as given has an error on {trials} trials of {digits(first.decisive)} times the noise floor."
    verb = "fell" if last.decisive < first.decisive else "went"
    return (
        f"The error on {trials} trials {verb} from {digits(first.decisive)} to {digits(last.decisive)} times the noise"
        f" floor in {len(steps) - 1} {'step' if len(steps) == 2 else 'steps'}."
    )


def decades(steps: Sequence[Step]) -> tuple[int, int]:
    """Powers of ten, lower and upper, that hold all drawable errors and the floor with room above and below it."""
    values = [value for step in steps for value in (step.learning, step.held_out) if drawable(value)]
    drawn = [1.0, *(float(value) for value in values if value is not None)]
    return min(-1, math.floor(math.log10(min(drawn)))), max(1, math.ceil(math.log10(max(drawn))))


def drawable(value: float | None) -> bool:
    """Whether a log axis has a place for a value: not for the infinite error of a model that diverged."""
    return value is not None and math.isfinite(value) and value > 0
