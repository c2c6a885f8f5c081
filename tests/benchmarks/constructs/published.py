"""How far runs of built models of the Standard Library are from the results that the Modelica Association publishes.

`MAP_LIB_RESULTS` names a checkout of modelica/MAP-LIB_ReferenceResults, made by Dymola with a relative tolerance of 1e-6.
"""

import csv
import os
from pathlib import Path

import fmpy
import numpy as np
from scipy.integrate import solve_ivp

from fmus.package import build_fmu
from fmus.symbolic.system import SymbolicSystem


def published(name: str) -> Path | None:
    """Folder of the published results of a model; None if there are none here."""
    folder = Path(os.environ.get("MAP_LIB_RESULTS", "")) / name.replace(".", "/")
    return folder if (folder / f"{folder.name}.csv").is_file() else None


def deviation(system: SymbolicSystem, folder: Path, fmu: Path) -> tuple[float, float | None]:
    """Largest difference of a run from the published signals, as a share of each signal's largest value, and from SciPy's Radau with a
    relative tolerance of 1e-9 (None for a model with events), which tells how much of that the published results are off.

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
    )
    near = np.min(np.abs(time[:, None] - run["time"]), axis=1) < 1e-6 * interval
    if len(events):
        near &= np.min(np.abs(time[:, None] - events), axis=1) > 1.5 * interval
    at = np.searchsorted(run["time"], time[near] - 0.1 * interval)
    far = max((_share(run[name][at], table[name][near], table[name]) for name in shown), default=np.nan)
    if system.remembers:
        return far, None
    solved = _integrated(system, run)
    return far, max((_share(run[name], solved[name], solved[name]) for name in shown if name in solved), default=np.nan)


def _share(found: np.ndarray, wanted: np.ndarray, whole: np.ndarray) -> float:
    return float(np.max(np.abs(found - wanted)) / max(np.max(np.abs(whole)), 1e-12))


def _integrated(system: SymbolicSystem, run: np.ndarray) -> dict[str, np.ndarray]:
    """States and algebraic variables by SciPy, from the run's first values."""
    parameters = [v.start for v in system.parameters]

    def parts(t: float, x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        dx, z = system.rhs(t, x, [], [], parameters)
        return np.array(dx).ravel(), np.array(z).ravel()

    time, start = run["time"], np.array([run[v.name][0] for v in system.states])
    solved = solve_ivp(
        lambda t, x: parts(t, x)[0],
        time[[0, -1]],
        start,
        "Radau",
        t_eval=time,
        rtol=1e-9,
        atol=1e-12,
        max_step=(time[-1] - time[0]) / 100,
    )
    z = np.array([parts(t, x)[1] for t, x in zip(time, solved.y.T, strict=True)])
    states = dict(zip((v.name for v in system.states), solved.y, strict=True))
    return states | dict(zip((v.name for v in system.algebraics), z.T, strict=True))
