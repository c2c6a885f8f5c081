"""Where a block finds its inputs in a model: positions and speeds among the states, drives among the inputs."""

from collections.abc import Collection, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from fmus.errors import MisfitError
from fmus.units import si_exponents
from orchestrator.measurements import BoundTrial
from orchestrator.measurements.wording import nearest
from orchestrator.models.correction import PREFIX
from orchestrator.models.missing_force import Force
from orchestrator.models.symbolic import SymbolicModel

MISSING, SPEED = "_missing", "_speed"
# Dimensions of what is a place or a speed: an input of this kind is something that a force can depend on.
_GEOMETRY = ({"m": 1}, {"m": 1, "s": -1}, {"rad": 1}, {"rad": 1, "s": -1})


@dataclass(frozen=True)
class Place:
    """A state or an input of a model, by its number."""

    of: Literal["state", "input"]
    index: int

    def unit(self, model: SymbolicModel) -> str:
        """Its unit."""
        return (model.system.states if self.of == "state" else model.system.inputs)[self.index].unit

    def along(self, force: Force, trial: BoundTrial) -> NDArray[np.float64]:
        """Its values at the samples of a trial, (n,)."""
        return force.states[:, self.index] if self.of == "state" else trial.inputs[:, self.index]


def coordinates(model: SymbolicModel, trials: Sequence[BoundTrial]) -> dict[str, Place]:
    """What a missing force may depend on: each signal that is a position, then their speeds.

    A model without positions of its own, such as a muscle whose length is imposed, has the inputs that are lengths or angles.

    Raises:
        MisfitError: if there is nothing of the kind.
    """
    if model.residual is None:
        raise MisfitError(f"{model.name} does not show which force it lacks on {', '.join(model.signals)}")
    states = [v.name for v in model.system.states]
    positions = model.residual.positions
    found = {signal: Place("state", states.index(at.state)) for signal, at in positions.items()}
    found |= {
        signal + SPEED: Place("state", states.index(at.speed))
        for signal, at in positions.items()
        if at.speed is not None
    }
    if not found:
        found = {name: place for name, place in _driven(model, trials).items() if _is_geometry(model, place)}
    if not found:
        raise MisfitError(f"{model.name} has no position, speed or length that a missing force could depend on")
    return found


def drives(model: SymbolicModel, trials: Sequence[BoundTrial], taken: Collection[str]) -> dict[str, Place]:
    """The inputs that move in some trial, such as activations and forces, less those that are coordinates.

    Args:
        model: the model.
        trials: the trials.
        taken: names of what is a coordinate already.
    """
    return {name: place for name, place in _driven(model, trials).items() if name not in taken}


def places_of(model: SymbolicModel, names: Sequence[str]) -> dict[str, Place]:
    """Places by name: a signal that is a position, its speed (`q1_speed`), or an input.

    Raises:
        MisfitError: if the model has no such place; the message names the nearest.
    """
    states, inputs = [v.name for v in model.system.states], [v.name for v in model.system.inputs]
    known = {name: Place("input", k) for k, name in enumerate(inputs) if not name.startswith(PREFIX)}
    for signal, at in model.residual.positions.items() if model.residual else ():
        known[signal] = Place("state", states.index(at.state))
        if at.speed is not None:
            known[signal + SPEED] = Place("state", states.index(at.speed))
    for name in names:
        if name not in known:
            raise MisfitError(f"{model.name} has no {name!r}; {nearest(name, known)}")
    return {name: known[name] for name in names}


def _driven(model: SymbolicModel, trials: Sequence[BoundTrial]) -> dict[str, Place]:
    every = np.concatenate([trial.inputs for trial in trials])
    return {
        v.name: Place("input", k)
        for k, v in enumerate(model.system.inputs)
        if np.ptp(every[:, k]) > 0.0 and not v.name.startswith(PREFIX)
    }


def _is_geometry(model: SymbolicModel, place: Place) -> bool:
    unit = model.system.inputs[place.index].unit
    return unit not in ("", "1") and si_exponents(unit).exponents in _GEOMETRY
