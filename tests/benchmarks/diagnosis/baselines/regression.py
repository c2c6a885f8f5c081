"""The regression that all baselines share: the engine's own screening residual and the columns of each candidate."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from fmus.catalogue import find_modelica_model
from orchestrator.compare.comparison import compare
from orchestrator.diagnosis.candidates import find_candidates
from orchestrator.diagnosis.cards import effect_library
from orchestrator.diagnosis.evidence import LearningData
from orchestrator.diagnosis.screening import Screener
from orchestrator.diagnosis.search import Searcher
from orchestrator.measurements import bind, load_measurements
from orchestrator.models.patch import free_slots
from orchestrator.models.symbolic import SymbolicModel


@dataclass(frozen=True, eq=False)
class Regression:
    """`residual` (m,) = sum of columns x coefficients + noise; `groups` holds the columns (m, c) of each candidate.

    `ids` (k,) name the effect of each candidate; several candidates (sites, laws) may be of one effect.
    """

    residual: np.ndarray
    groups: tuple[np.ndarray, ...]
    ids: tuple[str, ...]

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
    """The regression of a case; candidates that screening cannot judge, as those that hide positions, are left out."""
    source = find_modelica_model(model)
    system = source.compile()
    nominal = SymbolicModel(source.name, system)
    measurements = load_measurements(folder)
    floor = compare(nominal, measurements, workers=1).noise_floor
    data = bind(measurements, nominal.inputs, nominal.outputs)
    candidates, _ = find_candidates(source, system, effect_library())
    restricted = nominal.restricted(data.output_names)
    if restricted.residual is None:
        return Regression(np.zeros(0), (), ())
    learning = LearningData.of(data, floor)
    searcher = Searcher(source, restricted, free_slots(system), candidates, learning, 1, lambda message: None)
    screener = Screener(source, restricted, learning)
    found = [e for e in searcher._explain(screener) if e.columns.shape[1]]
    return Regression(
        -screener._nominal, tuple(e.columns for e in found), tuple(e.screened.candidates[0].card.id for e in found)
    )
