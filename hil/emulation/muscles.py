"""Six muscles, each an FMU, evaluated within a cycle: activations, angles and speeds in, joint torques out."""

from collections.abc import Mapping
from pathlib import Path

import numpy as np

from hil.emulation.anatomy import Anatomy
from orchestrator.cosim.built import built_fmu
from orchestrator.cosim.component import Component
from orchestrator.cosim.fmu import open_fmu
from orchestrator.cosim.system import ComponentSpec

MODEL = "arm-muscle"
_INPUTS, _OUTPUTS = ("alpha", "L", "V"), ("F",)


class Muscles:
    """The muscles of an anatomy; they have no state, so their forces follow from what a cycle shows alone.

    Args:
        fmu: FMU of one muscle; the built-in one without it.

    Raises:
        MisfitError: if it cannot be built or loaded.
    """

    def __init__(self, anatomy: Anatomy, fmu: Path | None = None) -> None:
        self.anatomy = anatomy
        path = fmu if fmu is not None else built_fmu(MODEL)
        self._fmus = [_started(path, k, values) for k, values in enumerate(anatomy.muscles, start=1)]

    def forces(self, activations: np.ndarray, q: np.ndarray, w: np.ndarray) -> np.ndarray:
        """Forces (6,) in N, positive when they pull, for activations (6,), angles (2,) rad and speeds (2,) rad/s.

        Raises:
            ComponentError: if an FMU fails.
        """
        lengths, speeds = self.anatomy.lengths(q), -w @ self.anatomy.arms
        found = np.empty(len(self._fmus))
        for k, fmu in enumerate(self._fmus):
            fmu.set(_INPUTS, (float(activations[k]), float(lengths[k]), float(speeds[k])))
            found[k] = fmu.get(_OUTPUTS)[0]
        return found

    def torques(
        self, activations: np.ndarray, q: np.ndarray, w: np.ndarray, strength: np.ndarray | float = 1.0
    ) -> np.ndarray:
        """Joint torques (2,) in N.m, flexion positive, of muscles that have shares `strength` (6,) of their nominal force.

        Args:
            activations: (6,), 0 to 1.
            q: angles (2,) in rad.
            w: speeds (2,) in rad/s.
            strength: share of each muscle's nominal force.

        Raises:
            ComponentError: if an FMU fails.
        """
        return np.asarray(self.anatomy.arms @ (strength * self.forces(activations, q, w)))


def _started(path: Path, number: int, values: Mapping[str, float]) -> Component:
    fmu = open_fmu(ComponentSpec(f"muscle {number}", "fmu", str(path)), Path())
    fmu.initialise(0.0, None, None)
    fmu.set(list(values), list(values.values()))
    fmu.start()
    return fmu
