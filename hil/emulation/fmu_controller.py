"""A controller that is an FMU: it gets what a cycle shows and gives the torques of the joints."""

from pathlib import Path

import numpy as np

from fmus.errors import MisfitError
from hil.control.controllers import Observed
from hil.robots import proficio
from orchestrator.cosim.built import built_fmu
from orchestrator.cosim.fmu import open_fmu
from orchestrator.cosim.system import ComponentSpec

_NUMBERS = range(1, proficio.JOINTS + 1)
INPUTS = (*(f"q{k}" for k in _NUMBERS), *(f"w{k}" for k in _NUMBERS), "fx", "fy", "fz")
OUTPUTS = tuple(f"tau{k}" for k in _NUMBERS)


class FmuController:
    """Steps an FMU along with the session, from arming on.

    Its inputs are among q1..3 (rad), w1..3 (rad/s), fx, fy, fz (N); outputs tau1..3 (N.m), of which those that it lacks are
    zero. The time of a cycle counts for its deadline as that of any controller.

    Args:
        source: an FMU, or what the factory makes one of: a built-in model or `FILE.mo:Class`.

    Raises:
        MisfitError: if it cannot be loaded, or has other ports.
    """

    def __init__(self, source: str) -> None:
        path = Path(source) if source.endswith(".fmu") else built_fmu(source)
        self._fmu = open_fmu(ComponentSpec("controller", "fmu", str(path)), Path())
        names = {kind: [p.name for p in self._fmu.ports if p.causality == kind] for kind in ("input", "output")}
        if unknown := [name for name in names["input"] if name not in INPUTS]:
            raise MisfitError(f"{source}: input {unknown[0]} is none of a controller's; there are {', '.join(INPUTS)}")
        self._inputs = names["input"]
        self._outputs = [name for name in OUTPUTS if name in names["output"]]
        if not self._outputs:
            raise MisfitError(f"{source} has none of the outputs {', '.join(OUTPUTS)}, so it controls nothing")
        self._time = -1.0

    def torque(self, observed: Observed) -> np.ndarray:
        """Joint torques (3,) in N.m; none before the arm is armed.

        Raises:
            ComponentError: if the FMU fails.
        """
        found = np.zeros(proficio.JOINTS)
        if observed.seconds < 0:
            return found
        seen = dict(zip(INPUTS, (*observed.q, *observed.w, *observed.f), strict=True))
        if self._time < 0:
            self._fmu.initialise(observed.seconds, None, None)
            self._set(seen)
            self._fmu.start()
            self._time = observed.seconds
        elif observed.seconds > self._time:
            # What was seen in the last cycle has held until now.
            self._time = self._fmu.step(self._time, observed.seconds - self._time).time
            self._set(seen)
        for name, value in zip(self._outputs, self._fmu.get(self._outputs), strict=True):
            found[OUTPUTS.index(name)] = value
        return found

    def _set(self, seen: dict[str, float]) -> None:
        if self._inputs:
            self._fmu.set(self._inputs, [float(seen[name]) for name in self._inputs])
