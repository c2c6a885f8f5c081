"""A comparison's curves on disk, as views read them: memory-mapped, with extremes and sums of blocks beside them.

A job that has compared calls `write(folder, comparison)`; the page calls `read(folder)`, which reads almost nothing:
10 trials of 1 million points cost a few MB of memory. `in_memory(comparison)` is for short records and tests.
"""

import json
import shutil
import tempfile
from collections.abc import Callable, Mapping
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from fmus.errors import MisfitError
from orchestrator.compare.result import Comparison, TrialCurves
from orchestrator.studio.views.data import Signal, ViewData, ViewTrial
from orchestrator.studio.views.pyramid import base_level, pyramid
from orchestrator.studio.views.sums import Sums, block_moments

SCHEMA = "misfit.views/1"
KINDS = ("measured", "modelled", "residual")
Arrays = Callable[[str], np.ndarray]


def write(folder: Path, comparison: Comparison) -> None:
    """Write what the views of a comparison need into a new folder; it appears as a whole or not at all.

    Raises:
        MisfitError: if the folder exists or cannot be written.
    """
    try:
        folder.parent.mkdir(parents=True, exist_ok=True)
        beside = Path(tempfile.mkdtemp(dir=folder.parent, prefix=f".{folder.name}-"))
        try:
            for place, curves in enumerate(comparison.curves):
                for name, array in _arrays(curves).items():
                    np.save(beside / f"{place}.{name}.npy", array)
            (beside / "views.json").write_text(json.dumps(_head(comparison)))
            beside.rename(folder)
        except BaseException:
            shutil.rmtree(beside, ignore_errors=True)
            raise
    except OSError as error:
        raise MisfitError(
            f"{folder}: curves cannot be written ({error.strerror or error}); free it and retry"
        ) from error


def read(folder: Path) -> ViewData:
    """Open what `write` wrote.

    Raises:
        MisfitError: if it is missing or damaged.
    """
    try:
        head = json.loads((folder / "views.json").read_text())
        if head["schema"] != SCHEMA:
            raise ValueError(f"schema {head['schema']!r:.60}, expected {SCHEMA!r}")
        return _view_data(head, [partial(_mapped, folder, place) for place in range(len(head["trials"]))])
    except (OSError, EOFError, ValueError, KeyError, TypeError) as error:
        raise MisfitError(f"{folder}: curves cannot be read ({error}); compare again") from error


def in_memory(comparison: Comparison) -> ViewData:
    """What the views of a comparison need, without a folder."""
    return _view_data(_head(comparison), [_arrays(curves).__getitem__ for curves in comparison.curves])


def _head(comparison: Comparison) -> dict[str, Any]:
    return {
        "schema": SCHEMA,
        "signals": list(comparison.signals),
        "units": dict(comparison.units),
        "noise_floor": dict(comparison.noise_floor),
        "trials": [{"name": c.file, "set": c.set, "inputs": list(c.inputs)} for c in comparison.curves],
        "where": {kind: list(comparison.where.get(kind, [])) for kind in ("state", "frequency")},
    }


def _arrays(curves: TrialCurves) -> dict[str, np.ndarray]:
    """All arrays of a trial by name; values that are not finite become NaN, time stays in double precision."""
    found = {"time": np.asarray(curves.time, dtype=float)}
    for i, name in enumerate(curves.measured):
        measured, modelled = np.asarray(curves.measured[name], float), np.asarray(curves.modelled[name], float)
        for kind, values in zip(KINDS, (measured, modelled, measured - modelled), strict=True):
            series = _single(values)
            found |= {f"{kind}.{i}": series, f"{kind}.{i}.extremes": base_level(series)}
        found[f"residual.{i}.sums"] = block_moments(found[f"residual.{i}"])
    return found | {f"input.{i}": _single(values) for i, values in enumerate(curves.inputs.values())}


def _mapped(folder: Path, place: int, name: str) -> np.ndarray:
    return np.load(folder / f"{place}.{name}.npy", mmap_mode="r")


def _single(values: np.ndarray) -> np.ndarray:
    with np.errstate(over="ignore", invalid="ignore"):
        series = np.asarray(values).astype(np.float32)
    return np.where(np.isfinite(series), series, np.float32(np.nan))


def _view_data(head: Mapping[str, Any], arrays: list[Arrays]) -> ViewData:
    signals = tuple(head["signals"])
    trials = []
    for trial, array in zip(head["trials"], arrays, strict=True):
        found = {name: _signal(array, i) for i, name in enumerate(signals)}
        inputs = {name: array(f"input.{i}") for i, name in enumerate(trial["inputs"])}
        trials.append(ViewTrial(trial["name"], trial["set"], array("time"), found, inputs))
    floor = {name: float(value) for name, value in head["noise_floor"].items()}
    return ViewData(
        signals, dict(head["units"]), floor, tuple(trials), head["where"]["state"], head["where"]["frequency"]
    )


def _signal(array: Arrays, i: int) -> Signal:
    measured, modelled, residual = (
        pyramid(array(f"{kind}.{i}"), np.asarray(array(f"{kind}.{i}.extremes"))) for kind in KINDS
    )
    return Signal(measured, modelled, residual, Sums(residual.series, np.asarray(array(f"residual.{i}.sums"))))
