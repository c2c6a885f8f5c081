"""What a set of effects explains in free runs of the learning trials."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from orchestrator.diagnosis.candidates import EffectSet
from orchestrator.measurements import BoundSet
from orchestrator.models.estimation import Fit, fit
from orchestrator.models.smoothing import SmoothedTrial

# A residual of a moving arm forgets itself in about a second; trials are of the order of ten.
SAMPLES_PER_TRIAL = 10
# A set that leaves less than this share of the mean square error matters, however small its parameters are: the cards'
# meaningful sizes are those of an arm.
DECISIVE = 0.25


@dataclass(frozen=True)
class LearningData:
    """The learning trials, smoothed, and the noise floor (ny,) of each signal in the order of the trials' columns."""

    trials: tuple[SmoothedTrial, ...]
    floor: np.ndarray

    @property
    def samples(self) -> int:
        """Rough number of independent samples of a residual in all trials and signals."""
        return SAMPLES_PER_TRIAL * len(self.trials) * len(self.floor)

    @staticmethod
    def of(data: BoundSet, floor: Mapping[str, float]) -> "LearningData":
        """Take the learning trials of a bound set."""
        noise = np.array([data.noise_std[name] for name in data.output_names])
        trials = tuple(SmoothedTrial(t.time, t.inputs, t.outputs, noise) for t in data.learning)
        return LearningData(trials, np.array([floor[name] for name in data.output_names]))


@dataclass(frozen=True)
class Refit:
    """A set of candidates fitted by free runs; `cost` is the mean square error over the floor's square, 1 = perfect."""

    effects: EffectSet
    fit: Fit
    samples: int

    @property
    def cost(self) -> float:
        """Mean over samples and signals of (error / floor)^2."""
        return self.fit.cost

    @property
    def half_bic(self) -> float:
        """Half the Bayesian information criterion; of two sets the smaller value explains better."""
        return half_bic(self.cost, len(self.fit.values), self.samples)

    @property
    def ids(self) -> tuple[str, ...]:
        """Effect ids in the order of the set."""
        return tuple(candidate.card.id for candidate in self.effects.candidates)

    def matters(self, before: float) -> bool:
        """Tell whether the set takes most of a cost `before` away, or has effects of meaningful size."""
        return self.is_present() and (self.cost < DECISIVE * before or self.is_meaningful())

    def is_present(self) -> bool:
        """Tell whether the data distinguish each effect from its absence.

        An effect with states of its own can follow a trial by their start values alone, its parameters at rest.
        """
        rows = zip(self.effects.owners(), self.effects.card_parameters, self.fit.values, self.fit.std, strict=True)
        present = {
            owner
            for owner, parameter, value, std in rows
            if np.isfinite(parameter.meaningful)
            and abs(value - parameter.absent) > max(2.0 * std, 1e-3 * abs(parameter.absent))
        }
        return len(present) == len(self.effects.candidates)

    def is_meaningful(self) -> bool:
        """Tell whether each effect departs from its absence by a size that matters."""
        big: set[int] = set()
        rows = zip(self.effects.owners(), self.effects.card_parameters, self.fit.values, strict=True)
        for owner, parameter, value in rows:
            if abs(value - parameter.absent) >= parameter.meaningful:
                big.add(owner)
        return len(big) == len(self.effects.candidates)


def refit(effects: EffectSet, learning: LearningData, first: np.ndarray | None = None) -> Refit:
    """Fit a set's parameters, and the start values of all learning trials, by free runs."""
    model, low, high = effects.model, *effects.bounds()
    span = high - low
    guess = effects.first_guess() if first is None else first
    # A value at its bound starts inside; one that is only small against its range, as in a small plant, stays.
    stuck = np.minimum(guess - low, high - guess) < 1e-6 * span
    guess = np.where(stuck, np.clip(guess, low + 0.01 * span, high - 0.01 * span), guess)
    found: Fit | None = None
    for _ in range(2):
        # Start values are bounded by what the encoders show, and what they show depends on a sensor error's size.
        parameters = model.compiled.with_values(guess)
        records = [model.record(trial, parameters) for trial in learning.trials]
        steps = max(model.substeps(r.time, r.inputs, r.start) for r in records[:2])
        again = fit(model.compiled, records, learning.floor, guess, low, high, substeps=steps, threads=1)
        found = again if found is None or again.cost < found.cost else found
        pressed = [
            np.isclose(s, r.start_low).any() or np.isclose(s, r.start_high).any()
            for s, r in zip(again.starts, records, strict=True)
        ]
        if not any(pressed) or not model.reads_through_parameters:
            break
        guess = again.values
    assert found is not None
    return Refit(effects, found, learning.samples)


def half_bic(cost: float, parameters: int, samples: int) -> float:
    """Half of BIC = n log(cost) + k log(n) for k parameters and n independent samples.

    A cost below 1, which is the floor, counts as 1: being better than the noise explains nothing.

    >>> half_bic(0.9, 5, 80) > half_bic(1.0, 2, 80)
    True
    """
    return 0.5 * (samples * float(np.log(max(cost, 1.0))) + parameters * float(np.log(samples)))
