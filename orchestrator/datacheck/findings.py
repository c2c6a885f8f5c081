"""What a check of data finds, the changes that would mend it, and data with these changes."""

import hashlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, Literal

import numpy as np

from fmus.errors import MisfitError
from fmus.units import conversion
from orchestrator.measurements import MeasurementSet, Trial
from orchestrator.measurements.matching import match_columns
from orchestrator.measurements.trial import MENDED
from orchestrator.models.contract import Model

Way = Literal["scale", "shift", "swap", "delay", "clock"]


@dataclass(frozen=True)
class Change:
    """A change of the columns of some model variables.

    `scale` multiplies them by `value`, `shift` adds it, `swap` exchanges two of them, `delay` reads them `value` s
    later than recorded, and `clock` multiplies the time. `meaning` says what would be wrong with the record as it is.
    """

    way: Way
    columns: tuple[str, ...]
    value: float
    meaning: str

    def applied(self, time: np.ndarray, values: np.ndarray, names: Sequence[str]) -> tuple[np.ndarray, np.ndarray]:
        """Return the changed time (n,) and the changed series (n, k) of the variables `names`.

        Args:
            time: (n,) in s.
            values: (n, k).
            names: the variables of the k columns.
        """
        if self.way == "clock":
            return time * self.value, values
        places = [names.index(name) for name in self.columns if name in names]
        changed = values.copy()
        if self.way == "scale":
            changed[:, places] *= self.value
        elif self.way == "shift":
            changed[:, places] += self.value
        elif self.way == "swap" and len(places) == 2:
            changed[:, places] = values[:, places[::-1]]
        elif self.way == "delay":
            for place in places:
                changed[:, place] = np.interp(time - self.value, time, values[:, place])
        return time, changed

    def noise(self, noise: np.ndarray, names: Sequence[str]) -> np.ndarray:
        """Noise (k,) of the changed series."""
        changed = noise.copy()
        places = [names.index(name) for name in self.columns if name in names]
        if self.way == "scale":
            changed[places] *= abs(self.value)
        elif self.way == "swap" and len(places) == 2:
            changed[places] = noise[places[::-1]]
        return changed

    def with_value(self, value: float) -> "Change":
        """The same change by another amount."""
        return Change(self.way, self.columns, value, self.meaning)


NO_CHANGE = Change("scale", (), 1.0, "")


Kind = Literal[
    "unit", "time_unit", "offset", "sign", "swap", "delay", "stuck", "saturated", "held", "trial", "nan", "input"
]


@dataclass(frozen=True)
class Finding:
    """One thing that is wrong, or may be, with a column or a trial.

    `evidence` says why in numbers, `proposal` what to do. A `strong` finding forbids to name physics. `change` is the
    mend of the columns, in the units of the model, `keep` one that leaves these seconds alone, and `trials` names those
    it concerns, none for all.
    """

    kind: Kind
    column: str
    trial: str
    evidence: str
    proposal: str
    strong: bool
    change: Change | None = None
    trials: tuple[str, ...] = ()
    keep: tuple[float, float] | None = None

    @property
    def can_be_mended(self) -> bool:
        """Whether `--mend` may accept the proposal: not where all trials show what the plant itself may do, such as a delay."""
        return (self.change is not None or self.keep is not None) and (self.strong or bool(self.trials))

    def to_json(self) -> dict[str, Any]:
        """The entry of `data_checks`."""
        where = {"column": self.column} if self.column else {}
        where |= {"trial": self.trial} if self.trial else {}
        return {"kind": self.kind, **where, "evidence": self.evidence, "proposal": self.proposal, "strong": self.strong}

    def __str__(self) -> str:
        where = " in ".join(part for part in (self.column, self.trial) if part)
        return f"data check, {where}: {self.evidence}; {self.proposal}"


def mended(model: Model, measurements: MeasurementSet, findings: Sequence[Finding]) -> MeasurementSet:
    """Return the set with the changes of the findings; its content hash tells it from the one as recorded.

    Args:
        model: the model, which says what the columns are.
        measurements: the set as recorded.
        findings: what was found; those without a change are passed over.
    """
    variables = {v.name: v.unit for v in (*model.inputs, *model.outputs)}
    columns = tuple(measurements.trials[0].columns)
    column_of = match_columns(columns, measurements.variables, list(variables)).column_of
    for finding in findings:
        if finding.change is not None or finding.keep is not None:
            chosen = finding.trials
            trials = [
                _mended(trial, finding, column_of, variables) if not chosen or trial.name in chosen else trial
                for trial in measurements.trials
            ]
            note = f"{MENDED}{finding.proposal} ({finding.evidence})"
            digest = hashlib.sha256(f"{measurements.content_hash} {note} {chosen}".encode()).hexdigest()
            notes = (*measurements.notes, note)
            measurements = replace(measurements, trials=tuple(trials), notes=notes, content_hash=digest)
    return measurements


def _mended(trial: Trial, finding: Finding, column_of: Mapping[str, str], units: Mapping[str, str]) -> Trial:
    if finding.change is not None:
        trial = _changed(trial, finding.change, column_of, units)
    if finding.keep is not None:
        first, last = finding.keep
        rows = (trial.time >= first) & (trial.time <= last)
        trial = replace(trial, time=trial.time[rows], columns={k: v[rows] for k, v in trial.columns.items()})
    return trial


def _changed(trial: Trial, change: Change, column_of: Mapping[str, str], units: Mapping[str, str]) -> Trial:
    names = [name for name in change.columns if name in column_of]
    factors = np.array([_factor(trial.units.get(column_of[name], ""), units[name]) for name in names])
    values = np.column_stack([trial.columns[column_of[name]] for name in names]) if names else np.zeros((0, 0))
    time, changed = change.applied(trial.time, values * factors, names)
    columns = {key: value.copy() for key, value in trial.columns.items()}
    for place, name in enumerate(names):
        columns[column_of[name]] = changed[:, place] / factors[place]
    return replace(trial, time=time.copy(), columns=columns)


def _factor(unit: str, wanted: str) -> float:
    """Factor from the unit of a column to that of its variable."""
    try:
        return conversion(unit, wanted) if unit and wanted else 1.0
    except MisfitError:
        return 1.0
