"""What recorders and people do to good records: filters, coarse digits, jitter, gaps, clocks, units."""

import math
from collections.abc import Callable, Mapping
from pathlib import Path

import numpy as np
from scipy import signal

from tests.benchmarks.diagnosis.truth.machines import Machine
from tests.benchmarks.diagnosis.world.files import Columns, rewrite

Dirt = Callable[[Columns, Machine, np.random.Generator], Columns]
# Corner of a zero-phase filter as a share of the sampling rate, coarse digits as a share of a signal's range, jitter and the
# lag of a clock in samples, gaps a trial.
CORNER, DIGITS, JITTER, LAG, GAPS = 0.08, 1 / 4000, 0.05, 3.0, 3


def filtered(columns: Columns, machine: Machine, random: np.random.Generator) -> Columns:
    """Outputs through a filter that runs forwards and backwards."""
    b, a = signal.butter(2, 2 * CORNER)
    return {name: signal.filtfilt(b, a, v) if name in machine.outputs else v for name, v in columns.items()}


def coarse(columns: Columns, machine: Machine, random: np.random.Generator) -> Columns:
    """Outputs from an encoder of few digits."""
    found = dict(columns)
    for name in machine.outputs:
        digit = DIGITS * float(np.ptp(columns[name]))
        found[name] = np.round(columns[name] / digit) * digit
    return found


def jittering(columns: Columns, machine: Machine, random: np.random.Generator) -> Columns:
    """Samples taken at other times than the clock says."""
    time = columns["time"]
    at = time + JITTER * float(np.median(np.diff(time))) * random.normal(size=len(time))
    return {name: values if name == "time" else np.interp(at, time, values) for name, values in columns.items()}


def with_gaps(columns: Columns, machine: Machine, random: np.random.Generator) -> Columns:
    """Rows that were lost, some tens at a time."""
    kept = np.ones(len(columns["time"]), bool)
    for begin in random.integers(10, len(kept) - 60, GAPS):
        kept[begin : begin + int(random.integers(5, 40))] = False
    return {name: values[kept] for name, values in columns.items()}


def late_inputs(columns: Columns, machine: Machine, random: np.random.Generator) -> Columns:
    """Inputs whose clock is late against that of the outputs, so that outputs answer before them."""
    time = columns["time"]
    ago = time - LAG * float(np.median(np.diff(time)))
    return {name: np.interp(ago, time, v) if name in machine.inputs else v for name, v in columns.items()}


DIRT: Mapping[str, Dirt] = {
    "filtered": filtered,
    "coarse": coarse,
    "jitter": jittering,
    "gaps": with_gaps,
    "late inputs": late_inputs,
}
# What a data check must find; the rest is honest dirt that a diagnosis must live with.
WRONG = {"late inputs": "delay"}

# Column units that people mix up: (what the column is multiplied by, kind of the finding).
_MISTAKES: Mapping[str, tuple[float, ...]] = {
    "rad": (180 / math.pi, math.pi / 180, 1e3),
    "m": (1e3, 1e2),
    "N": (1 / 9.80665, 1e3, 1e-3),
    "N.m": (1 / 9.80665, 1e3, 1e-3),
    "m3/s": (60.0, 3600.0, 1e3),
}


def make_dirty(folder: Path, machine: Machine, kind: str, random: np.random.Generator) -> None:
    """Change all trials of a written case."""
    rewrite(folder, lambda columns, number: DIRT[kind](columns, machine, random))


def make_wrong(folder: Path, machine: Machine, random: np.random.Generator) -> tuple[str, float]:
    """Give a column of a written case another unit than case.toml says; returns the column and its factor."""
    units = {**machine.outputs, **{n: u for n, u in machine.inputs.items() if u in _MISTAKES}}
    column = str(random.choice(sorted(units)))
    wrong = float(random.choice(_MISTAKES[units[column]]))
    rewrite(folder, lambda columns, number: {**columns, column: columns[column] * wrong})
    return column, wrong
