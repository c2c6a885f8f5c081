"""The force that a black-box FMU lacks at each instant, from its rates at the measured motion."""

from collections.abc import Sequence

import numpy as np

from orchestrator.blackbox.model import CoupledModel
from orchestrator.blackbox.worker import RatesRequest
from orchestrator.models.smoothing import SmoothedTrial
from orchestrator.models.symbolic import SymbolicModel


def missing_forces(model: SymbolicModel, trials: Sequence[SmoothedTrial]) -> list[tuple[str, str, list[np.ndarray]]]:
    """Output, unit and series along each trial of the force that the measured accelerations take beyond the FMU's own.

    The FMU is asked for its rates at the measured states and inputs, and again with each force input moved; the forces
    solve rates + slopes force = measured accelerations at each sample.

    Returns:
        Nothing for an FMU that is stepped, that has states which no measured output shows, or no force input for each
        measured position.

    Raises:
        ComponentError: if the FMU fails.
    """
    if not isinstance(model, CoupledModel) or model.file.description.cosimulation:
        return []
    sites, names = model.sites, [v.name for v in model.sites.outputs]
    shown = {k: p for k, p in sites.positions.items() if names[k] in model.signals and p.speed is not None}
    states = {s for p in shown.values() for s in (p.state, p.speed)}
    if not sites.forces or not sites.one_force_each or len(states) < len(sites.states):
        return []
    if {force.output for force in sites.forces} != set(shown):
        return []
    series = [_along(model, trial) for trial in trials]
    return [
        (names[f.output], sites.inputs[f.input].unit, [f.sign * part[:, k] for part in series])
        for k, f in enumerate(sites.forces)
    ]


def _along(model: CoupledModel, trial: SmoothedTrial) -> np.ndarray:
    """Missing forces (n, forces) along a trial, thinned."""
    sites, names = model.sites, [v.name for v in model.sites.outputs]
    states = np.zeros((len(trial.time), len(sites.states)))
    wanted = np.zeros((len(trial.time), len(sites.forces)))
    speeds = []
    for j, force in enumerate(sites.forces):
        position, m = sites.positions[force.output], model.signals.index(names[force.output])
        assert position.speed is not None
        states[:, position.state] = (trial.values[:, m] - position.offset) / position.slope
        states[:, position.speed] = trial.speeds[:, m] / position.slope
        wanted[:, j] = trial.accelerations[:, m] / position.slope
        speeds.append(position.speed)
    # A step of the size of what acts: the answer of accelerations to forces is a straight line.
    size = model.sites.force_scales.sizes.get("force", 1.0)
    moved = [trial.inputs, *(trial.inputs + size * (np.arange(len(sites.inputs)) == f.input) for f in sites.forces)]
    rates = [
        np.asarray(model.file.processes.ask(RatesRequest(sites.wiring, trial.time, states, inputs)))[:, speeds]
        for inputs in moved
    ]
    slopes = np.stack([(part - rates[0]) / size for part in rates[1:]], axis=2)
    forces = np.linalg.pinv(slopes) @ (wanted - rates[0])[:, :, None]
    return np.asarray(trial.smoother.thin(forces[:, :, 0]))
