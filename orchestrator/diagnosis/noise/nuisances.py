"""Nuisances: parameters with stated tolerances, and clocks; refitted in every fit and never named as a discovery."""

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from fmus.errors import MisfitError
from fmus.symbolic.system import SymbolicSystem
from orchestrator.diagnosis.noise.thresholds import REACH
from orchestrator.models.estimation import Prior


@dataclass(frozen=True)
class Nuisances:
    """Parameters `names` that lie within `std` of `mean` (both (n,), in their units); `shift_std` s for clocks."""

    names: tuple[str, ...] = ()
    mean: np.ndarray = field(default_factory=lambda: np.zeros(0))
    std: np.ndarray = field(default_factory=lambda: np.zeros(0))
    shift_std: float = 0.0

    def prior(self, effect_parameters: int) -> Prior:
        """The prior of a fit whose first free parameters are those of effects."""
        blank = np.zeros(effect_parameters)
        return Prior(np.r_[blank, self.mean], np.r_[blank + np.inf, self.std], self.shift_std)

    @property
    def low(self) -> np.ndarray:
        """Lower bounds."""
        return self.mean - REACH * self.std

    @property
    def high(self) -> np.ndarray:
        """Upper bounds."""
        return self.mean + REACH * self.std


def nuisances(system: SymbolicSystem, tolerances: Mapping[str, float], shift_std: float) -> Nuisances:
    """Find the parameters that stated tolerances concern.

    Args:
        tolerances: relative standard deviation by parameter; `m` or `linkage.m` means every `linkage.m[k]` too, and
            `default` every parameter that is not zero.

    Raises:
        MisfitError: if a tolerance names no parameter of the model.
    """
    chosen: dict[str, float] = {}
    default = tolerances.get("default", 0.0)
    if default > 0:
        chosen = {v.name: default for v in system.parameters if v.start}
    for name, relative in tolerances.items():
        if name == "default":
            continue
        found = [v.name for v in system.parameters if name in _names(v.name)]
        if not found:
            known = ", ".join(dict.fromkeys(v.name.split("[")[0] for v in system.parameters))
            raise MisfitError(f"[tolerances] names {name!r}, which {system.name} does not have; it has {known}")
        chosen |= dict.fromkeys(found, relative)
    values = {v.name: v.start or 0.0 for v in system.parameters}
    names = tuple(name for name, relative in chosen.items() if relative > 0 and values[name] != 0)
    mean = np.array([values[name] for name in names])
    std = np.array([abs(values[name]) * chosen[name] for name in names])
    return Nuisances(names, mean, std, shift_std)


def _names(full: str) -> set[str]:
    """What a user may call a parameter: `linkage.m[1]`, `linkage.m`, `m[1]`, `m`."""
    array = full.split("[")[0]
    return {full, array, full.rsplit(".", 1)[-1], array.rsplit(".", 1)[-1]}
