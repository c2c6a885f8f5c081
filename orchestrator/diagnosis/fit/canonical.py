"""One form of oscillations: one of negative amplitude is one of positive amplitude half a turn later.

A fit ends at either, whichever is nearer. Answers give the one in which the largest amplitude is positive, so that two of
them can be compared, and an interval be held against a number from elsewhere.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from fmus.symbolic.system import SymbolicSystem
from orchestrator.diagnosis.fit.candidates import EffectSet
from orchestrator.models.estimation import Fit, Record


@dataclass(frozen=True)
class Oscillation:
    """Where an effect keeps an oscillation: its amplitudes among a set's parameters, sine and cosine among the states."""

    amplitudes: tuple[int, ...]
    phase: tuple[int, int]


def oscillates(effects: EffectSet) -> bool:
    """Whether an effect of a set has a phase of its own in each trial."""
    return bool(effects.candidates) and any(p.phase for p in effects.card_parameters)


def oscillations(effects: EffectSet, system: SymbolicSystem) -> Iterator[Oscillation]:
    """The oscillations among the effects of a set, by their places in a system of that set."""
    owners, cards, names = effects.owners(), effects.card_parameters, [v.name for v in system.states]
    for k, candidate in enumerate(effects.candidates):
        for parameter in candidate.card.parameters:
            if parameter.phase:
                own = tuple(i for i, card in enumerate(cards) if card is parameter and owners[i] == k)
                sine, cosine = (names.index(f"{candidate.slot}.{parameter.phase}[{i}]") for i in (1, 2))
                yield Oscillation(own, (sine, cosine))


def canonical(effects: EffectSet, fit: Fit, records: Sequence[Record]) -> tuple[Fit, tuple[Record, ...]]:
    """A fit of a set and its records in the form that has positive amplitudes; the misfit is the same to the last bit.

    What was expected of start values turns with them.

    Args:
        effects: the set.
        fit: its fit.
        records: the trials that it was fitted to, with what was expected of their start values.
    """
    if not oscillates(effects):
        return fit, tuple(records)
    parameters, states = np.ones(len(fit.values)), np.ones(len(effects.model.system.states))
    for oscillation in oscillations(effects, effects.model.system):
        if fit.values[max(oscillation.amplitudes, key=lambda i: abs(fit.values[i]))] < 0:
            parameters[list(oscillation.amplitudes)] = -1.0
            states[list(oscillation.phase)] = -1.0
    if np.all(parameters > 0):
        return fit, tuple(records)
    return _turned(fit, parameters, states), tuple(_mirrored(record, states) for record in records)


def _turned(fit: Fit, parameters: np.ndarray, states: np.ndarray) -> Fit:
    correlation = fit.correlation * np.outer(parameters, parameters) if fit.correlation.size else fit.correlation
    starts = tuple(start * states for start in fit.starts)
    return replace(fit, values=fit.values * parameters, starts=starts, correlation=correlation)


def _mirrored(record: Record, states: np.ndarray) -> Record:
    low = np.where(states > 0, record.start_low, -record.start_high)
    high = np.where(states > 0, record.start_high, -record.start_low)
    return replace(record, start=record.start * states, start_low=low, start_high=high)
