"""Which outputs of a stepped FMU read a state whose start value can be set, and which state is their rate: by short runs."""

from functools import lru_cache

import numpy as np

from orchestrator.blackbox.compiled import CoupledRuns
from orchestrator.blackbox.coupled import couple
from orchestrator.blackbox.fmu_file import FmuFile
from orchestrator.blackbox.sites import Position, plain_sites

# Slopes come from differences of runs, whose solvers adapt; this much they may be off.
LOOSE = 0.05
SAMPLES = 3


@lru_cache(maxsize=16)
def positions_by_runs(file: FmuFile, step: float) -> dict[int, Position]:
    """Outputs that begin at one settable state, and the state that is their rate; empty where none does.

    Args:
        step: sample interval in s, at which the FMU can be stepped.

    Raises:
        ComponentError: if the FMU fails.
    """
    sites = plain_sites(file.started)
    if not file.description.cosimulation or not sites.states:
        return {}
    runs = CoupledRuns(
        couple(file.path.name, sites, ()),
        sites,
        file.description.settable,
        file.processes,
        [v.name for v in sites.outputs],
    )
    first = np.array([0.0 if v.start is None else v.start for v in sites.states])
    here, there = (_found(runs, start, step) for start in (first, first + 0.37 * (1 + np.abs(first))))
    # An output that merely happens to be linear where the FMU starts is none.
    return {k: p for k, p in here.items() if k in there and _alike(p, there[k])}


def _found(runs: CoupledRuns, start: np.ndarray, step: float) -> dict[int, Position]:
    time = step * np.arange(SAMPLES)
    idle = np.array([0.0 if v.start is None else v.start for v in runs.sites.inputs])
    run = runs.run(time, np.tile(idle, (SAMPLES, 1)), runs.parameters, start, sensitivities=True)
    assert run.sensitivities is not None
    found = {}
    for k, (begin, next_one) in enumerate(zip(run.sensitivities[0], run.sensitivities[1], strict=True)):
        largest = float(np.abs(begin).max())
        shown = np.flatnonzero(np.abs(begin) > LOOSE * max(largest, 1e-300))
        if len(shown) != 1:
            continue
        state = int(shown[0])
        slope = float(begin[state])
        rates = (next_one - begin) / step / slope
        speeds = [int(j) for j in np.flatnonzero(np.abs(rates - 1) < LOOSE) if j != state]
        speed = speeds[0] if len(speeds) == 1 else None
        found[k] = Position(state, speed, slope, float(run.outputs[0, k] - slope * start[state]))
    return found


def _alike(one: Position, other: Position) -> bool:
    same = (one.state, one.speed) == (other.state, other.speed)
    return same and abs(one.slope - other.slope) < LOOSE * abs(one.slope)
