"""The regression that all baselines share, by linear algebra of its own: what is left of the equations, and what each
candidate would add to them to first order, along the smoothed measurements."""

from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass
from functools import cached_property
from itertools import groupby
from pathlib import Path

import numpy as np
from scipy import signal

from fmus.catalogue import find_modelica_model
from fmus.errors import ComponentError
from orchestrator.diagnosis.fit.candidates import EffectSet
from orchestrator.diagnosis.fit.evidence import smoothed
from orchestrator.diagnosis.fit.extensible import find_candidates
from orchestrator.diagnosis.linear.tangent import points
from orchestrator.library.cards import Candidate, effect_library
from orchestrator.measurements import bind, load_measurements
from orchestrator.models.smoothing import SmoothedTrial
from orchestrator.models.symbolic import SymbolicModel

# Second differences of a noisy position are smoothed down to this; the cards' forces are slower.
CORNER_HZ = 2.0
SAMPLES = 1000


@dataclass(frozen=True, eq=False)
class Regression:
    """`residual` (m,) = sum of columns x coefficients + noise; `groups` holds the columns (m, c) of each candidate.

    `ids` (k,) name the effect of each candidate; several candidates (sites, laws) may be of one effect. `samples` is m
    before the rows were compressed.
    """

    residual: np.ndarray
    groups: tuple[np.ndarray, ...]
    ids: tuple[str, ...]
    samples: int

    @cached_property
    def compressed(self) -> "Regression":
        """The same least-squares problems in as many rows as there are columns and one more."""
        both = np.column_stack([*self.groups, self.residual])
        triangle = np.linalg.qr(both, mode="r")
        edges = np.cumsum([group.shape[1] for group in self.groups])[:-1]
        groups = tuple(np.split(triangle[:, :-1], edges, axis=1))
        return Regression(triangle[:, -1], groups, self.ids, self.samples)

    @property
    def columns(self) -> np.ndarray:
        """All columns side by side, each scaled to unit length."""
        whole = np.hstack([unit(group) for group in self.groups])
        return whole

    @property
    def owners(self) -> np.ndarray:
        """Candidate that each column belongs to."""
        return np.concatenate([np.full(group.shape[1], k) for k, group in enumerate(self.groups)])


def unit(columns: np.ndarray) -> np.ndarray:
    """Columns scaled to unit length; columns of zeros stay.

    >>> unit(np.array([[3.0, 0.0], [4.0, 0.0]])).tolist()
    [[0.6, 0.0], [0.8, 0.0]]
    """
    size = np.linalg.norm(columns, axis=0)
    return columns / np.where(size > 0, size, 1.0)


def explained(residual: np.ndarray, columns: np.ndarray) -> float:
    """Share of the residual's square that columns explain."""
    if columns.shape[1] == 0:
        return 0.0
    coefficients, *_ = np.linalg.lstsq(unit(columns), residual, rcond=1e-8)
    left = residual - unit(columns) @ coefficients
    return 1.0 - float(left @ left) / float(residual @ residual)


def regression_of(model: str, folder: Path) -> Regression:
    """The regression of a case; candidates that hide positions or cannot be run on it are left out."""
    source = find_modelica_model(model)
    system = source.compile()
    whole = SymbolicModel(source.name, system)
    data = bind(load_measurements(folder), whole.inputs, whole.outputs)
    nominal = whole.restricted(data.output_names)
    if nominal.residual is None:
        return Regression(np.zeros(0), (), (), 0)
    trials = smoothed(data.learning, np.array([data.noise_std[name] for name in data.output_names]))
    plain = _series(nominal, nominal.compiled.parameters, trials)[:, :, 0]
    size = np.sqrt(np.mean(plain**2, axis=0))[:, None]
    found: list[tuple[str, np.ndarray]] = []
    for part in _sharing_a_model(find_candidates(source, system, effect_library())[0]):
        effects = EffectSet(source, part, nominal.signals)
        with suppress(ComponentError):
            columns = (_columns(effects, trials, plain) / size).reshape(plain.size, -1)
            owners = np.resize(np.array([*effects.owners()]), columns.shape[1]) if len(part) > 1 else 0
            own = [columns[:, owners == k] if len(part) > 1 else columns for k in range(len(part))]
            found += [(part[0].card.id, unit(c)) for c in own if c.any() and np.all(np.isfinite(c))]
    return Regression(-(plain / size[:, 0]).ravel(), tuple(g for _, g in found), tuple(i for i, _ in found), plain.size)


def _sharing_a_model(candidates: Sequence[Candidate]) -> list[list[Candidate]]:
    """Candidates one by one, but for those that differ only in which element of one parameter is theirs."""
    cards = [list(group) for _, group in groupby(candidates, key=lambda c: (c.card.id, c.card.variant))]
    return [
        part for group in cards for part in ([group] if len(group[0].card.parameters) == 1 else [[c] for c in group])
    ]


def _columns(effects: EffectSet, trials: Sequence[SmoothedTrial], plain: np.ndarray) -> np.ndarray:
    """Columns (m, ny, k) of the points at which a card is linearised, none if it hides the positions."""
    model = effects.model
    if model.residual is None:
        return np.zeros((*plain.shape, 0))
    found = []
    for values, difference in points(effects):
        here = _series(model, model.compiled.with_values(values), trials)
        found.append(here[:, :, 1:])
        if difference and len(effects.candidates) == 1:
            found.append(here[:, :, :1] - plain[:, :, None])
    return np.concatenate(found, axis=2)


def _series(model: SymbolicModel, parameters: np.ndarray, trials: Sequence[SmoothedTrial]) -> np.ndarray:
    """What is left of the equations, then its slopes in the free parameters: (m, ny, 1 + k), smoothed and thinned."""
    assert model.residual is not None
    names = [v.name for v in model.system.states]
    hidden = [names.index(v.name) for v in model.residual.system.states]
    parts = []
    for trial in trials:
        start = model.record(trial, parameters).start[hidden]
        inputs = model.residual_inputs(trial)
        run = model.compiled_residual.run(trial.time, inputs, parameters, start, sensitivities=True)
        assert run.sensitivities is not None
        parts.append(_calm(trial, np.dstack([run.outputs, run.sensitivities[:, :, len(hidden) :]])))
    return np.concatenate(parts)


def _calm(trial: SmoothedTrial, series: np.ndarray) -> np.ndarray:
    """A series of a trial without what is faster than `CORNER_HZ` at 250 Hz, in about `SAMPLES` samples for four trials."""
    b, a = signal.butter(2, CORNER_HZ / 125.0)
    calm = signal.filtfilt(b, a, series, axis=0)
    edge = len(series) // 20
    return calm[edge : len(series) - edge : max(1, 4 * len(series) // SAMPLES)]
