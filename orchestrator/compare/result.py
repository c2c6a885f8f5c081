"""What a comparison of a model with measurements found."""

from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from typing import Any

import numpy as np

from orchestrator.compare.estimates import FloorEstimate, floor_sentence
from orchestrator.datacheck.findings import Finding
from orchestrator.shown import Shown, drawing_of


@dataclass(frozen=True)
class TrialErrors:
    """Errors of one trial's free run: `rmse` in the signal's unit, `fit_percent` = 100 (1 - rmse/std)."""

    file: str
    set: str
    rmse: Mapping[str, float]
    fit_percent: Mapping[str, float]


@dataclass(frozen=True)
class SetErrors:
    """Errors over the samples of several trials; `over_floor` = rms over signals of rmse / noise floor."""

    rmse: Mapping[str, float]
    over_floor: float


@dataclass(frozen=True)
class TrialCurves:
    """Time series of one trial for figures: `time` in s, signals in their units, all of shape (n,).

    `inputs` are those that move.
    """

    file: str
    set: str
    time: np.ndarray
    measured: Mapping[str, np.ndarray]
    modelled: Mapping[str, np.ndarray]
    inputs: Mapping[str, np.ndarray] = field(default_factory=dict)


@dataclass(frozen=True)
class Comparison:
    """Free runs of a model against measured trials.

    `where` tells where the error is: lists of plain mappings under "signal", "time", "state" and "frequency".
    `findings` says the same in sentences. `curves` is not part of the JSON result. `data_checks` says what is wrong
    with the record, `mended` what was mended before.
    """

    model: str
    data: str
    signals: tuple[str, ...]
    units: Mapping[str, str]
    noise_floor: Mapping[str, float]
    trials: tuple[TrialErrors, ...]
    learning: SetErrors
    held_out: SetErrors | None
    where: Mapping[str, list[dict[str, Any]]]
    findings: tuple[str, ...] = ()
    notes: tuple[str, ...] = ()
    noise_estimates: Mapping[str, FloorEstimate] = field(default_factory=dict)
    curves: tuple[TrialCurves, ...] = field(default=(), repr=False)
    data_checks: tuple[Finding, ...] = ()
    mended: tuple[str, ...] = ()

    @property
    def noise_sentences(self) -> tuple[str, ...]:
        """Where the noise floor of each signal comes from."""
        return tuple(floor_sentence(name, self.units[name], each) for name, each in self.noise_estimates.items())

    def plot(self, trial: str | None = None) -> Shown:
        """Curves of a trial for a notebook, of the first one worth a figure if none is named.

        Raises:
            MisfitError: if there is no such trial.
        """
        return drawing_of("comparison").plot(self, trial)

    def _repr_html_(self) -> str:
        return drawing_of("comparison").html(self)

    def to_json(self) -> dict[str, Any]:
        """Return the `misfit.compare/1` document."""
        return {
            "schema": "misfit.compare/1",
            "model": self.model,
            "data": self.data,
            "signals": list(self.signals),
            "units": dict(self.units),
            "noise_floor": dict(self.noise_floor),
            "trials": [asdict(trial) | self._times_floor(trial.rmse) for trial in self.trials],
            "learning": asdict(self.learning) | self._times_floor(self.learning.rmse),
            "held_out": None
            if self.held_out is None
            else asdict(self.held_out) | self._times_floor(self.held_out.rmse),
            "where": dict(self.where),
            "findings": list(self.findings),
            "notes": [*self.notes, *self.noise_sentences],
            "noise_estimates": {name: asdict(each) for name, each in self.noise_estimates.items()},
            "data_checks": [finding.to_json() for finding in self.data_checks],
            "mended": list(self.mended),
        }

    def _times_floor(self, rmse: Mapping[str, float]) -> dict[str, Any]:
        """Errors as multiples of the noise floor, by signal; none for a floor of 0."""
        floor = self.noise_floor
        return {"times_floor": {name: rmse[name] / floor[name] if floor[name] else None for name in rmse}}
