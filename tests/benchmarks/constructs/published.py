"""How far runs of built models of the Standard Library are from the results that the Modelica Association publishes.

`MAP_LIB_RESULTS` names a checkout of modelica/MAP-LIB_ReferenceResults, made by Dymola with a relative tolerance of 1e-6.
"""

import csv
import os
from pathlib import Path

import fmpy
import numpy as np

from fmus.package import build_fmu
from fmus.symbolic.system import SymbolicSystem
from tests.benchmarks.constructs.pieces import NoEnd, Pieces

# Of an interval between outputs: how near to an event an instant does not count.
NEAR = 1e-3
# Of the FMU's own integration; by itself an FMU takes 1e-6, as the published runs do.
TOLERANCE = 1e-10


def published(name: str) -> Path | None:
    """Folder of the published results of a model; None if there are none here."""
    folder = Path(os.environ.get("MAP_LIB_RESULTS", "")) / name.replace(".", "/")
    return folder if (folder / f"{folder.name}.csv").is_file() else None


def deviation(system: SymbolicSystem, folder: Path, fmu: Path) -> tuple[float, float | None]:
    """Largest difference of a run from the published signals, as a share of each signal's largest value, and from SciPy's Radau with a
    relative tolerance of 1e-9 from event to event, which tells how much of that the published results are off; None if that integration
    does not come to an end.

    Instants next to an event are left out, since a jump may be shown on either side.

    Args:
        system: the model as it was built.
        folder: of its published results.
        fmu: file to write the FMU to.
    """
    with (folder / f"{folder.name}.csv").open() as file:
        names, *rows = list(csv.reader(file))
    table = dict(zip(names, np.array(rows, dtype=float).T, strict=True))
    time = table["time"]
    interval = float(np.median(np.diff(time)))
    events = time[1:][np.diff(time) < 1e-9 * time[-1]]
    states = [v.name for v in system.states]
    known = {*states, *(v.name for v in system.algebraics), *(f"der({name})" for name in states)}
    shown = [name for name in names[1:] if name in known]
    run = fmpy.simulate_fmu(
        str(build_fmu(system, fmu, stop_time=float(time[-1]), step_size=interval)),
        start_time=float(time[0]),
        stop_time=float(time[-1]),
        output_interval=interval,
        output=list(dict.fromkeys([*shown, *states])),
        fmi_type="CoSimulation",
        relative_tolerance=TOLERANCE,
    )
    near = _distance(time, run["time"]) < 1e-6 * interval
    near &= _distance(time, events) > 1.5 * interval
    at = np.searchsorted(run["time"], time[near] - 0.1 * interval)
    far = max((_share(run[name][at], table[name][near], table[name]) for name in shown), default=np.nan)
    pieces = Pieces(system, [v.start for v in system.parameters])
    try:
        solved = pieces.run(run["time"], np.array([run[v.name][0] for v in system.states]))
    except NoEnd:
        return far, None
    apart = np.ones(len(run), dtype=bool)
    for event in pieces.events:
        apart &= np.abs(run["time"] - event) > NEAR * interval
    both = [name for name in shown if name in solved]
    return far, max((_share(run[name][apart], solved[name][apart], solved[name]) for name in both), default=np.nan)


def _distance(times: np.ndarray, others: np.ndarray) -> np.ndarray:
    """From each of some times to the nearest of others, which are sorted."""
    fence = np.concatenate([[-np.inf], others, [np.inf]])
    behind = np.searchsorted(fence, times)
    return np.minimum(np.abs(fence[behind] - times), np.abs(times - fence[behind - 1]))


def _share(found: np.ndarray, wanted: np.ndarray, whole: np.ndarray) -> float:
    return float(np.max(np.abs(found - wanted), initial=0.0) / max(np.max(np.abs(whole)), 1e-12))
