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


def published(name: str) -> Path | None:
    """Folder of the published results of a model; None if there are none here."""
    folder = Path(os.environ.get("MAP_LIB_RESULTS", "")) / name.replace(".", "/")
    return folder if (folder / f"{folder.name}.csv").is_file() else None


def deviation(system: SymbolicSystem, folder: Path, fmu: Path) -> tuple[float, str]:
    """Largest difference from the published signals, as a share of each signal's largest value, and the signal that it is of.

    Instants next to an event are left out, since a jump may be shown on either side.

    Args:
        system: the model as it was built.
        folder: of its published results.
        fmu: file to write the FMU to.
    """
    with (folder / f"{folder.name}.csv").open() as file:
        names, *rows = list(csv.reader(file))
    table = np.array(rows, dtype=float)
    time = table[:, 0]
    interval = float(np.median(np.diff(time)))
    events = time[1:][np.diff(time) < 1e-9 * time[-1]]
    run = fmpy.simulate_fmu(
        str(build_fmu(system, fmu, stop_time=float(time[-1]), step_size=interval)),
        start_time=float(time[0]),
        stop_time=float(time[-1]),
        output_interval=interval,
        output=[name for name in names[1:] if name in _variables(system)],
        fmi_type="CoSimulation",
    )
    near = np.min(np.abs(time[:, None] - run["time"]), axis=1) < 1e-6 * interval
    if len(events):
        near &= np.min(np.abs(time[:, None] - events), axis=1) > 1.5 * interval
    at = np.searchsorted(run["time"], time[near] - 0.1 * interval)
    worst, of = 0.0, ""
    for name in run.dtype.names[1:]:
        value, wanted = run[name][at].astype(float), table[near, names.index(name)]
        share = float(np.max(np.abs(value - wanted)) / max(np.max(np.abs(table[:, names.index(name)])), 1e-12))
        if not share <= worst:
            worst, of = share, name
    return worst, of


def _variables(system: SymbolicSystem) -> set[str]:
    rates = (f"der({v.name})" for v in system.states)
    return {*(v.name for v in (*system.states, *system.algebraics)), *rates}
