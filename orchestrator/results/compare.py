"""Two results side by side: how far apart each signal gets, and when it first does."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fmus.errors import MisfitError
from fmus.units import conversion
from orchestrator.results.column import Column
from orchestrator.results.result import Result

# Signals that come from the same equations in another order of summation differ by less of their range than this.
TOLERANCE = 1e-6


@dataclass(frozen=True)
class SignalDifference:
    """What a signal of the second result differs by from the first, in the first one's unit.

    `largest` is the largest absolute difference, at `largest_at` s; `rms` its root mean square over time, `spread` the
    distance from the smallest to the largest value of the first, `parted_at` the first time in s with a difference
    beyond the tolerance, None if there is none. A value that is not a number in one of the two counts as an infinite
    difference.
    """

    name: str
    unit: str
    largest: float
    largest_at: float
    rms: float
    spread: float
    parted_at: float | None


@dataclass(frozen=True)
class ResultComparison:
    """Differences of the signals that both have, the largest share of its spread first; the names that only one has.

    `start` and `stop` limit the time in s that both cover.
    """

    signals: tuple[SignalDifference, ...]
    only_first: tuple[str, ...]
    only_second: tuple[str, ...]
    start: float
    stop: float
    tolerance: float

    @property
    def same(self) -> bool:
        """Whether no signal parts and none is missing."""
        return not (self.only_first or self.only_second or any(s.parted_at is not None for s in self.signals))

    @property
    def exercised(self) -> bool:
        """Whether any signal moved, in one of the two at least; else it is not known whether they agree."""
        return any(s.spread or s.largest for s in self.signals)

    def to_json(self) -> dict[str, Any]:
        """The comparison as JSON; infinite differences are None."""
        signals = [
            {**vars(s), "largest": _finite(s.largest), "rms": _finite(s.rms), "spread": _finite(s.spread)}
            for s in self.signals
        ]
        return {**vars(self), "signals": signals, "same": self.same, "exercised": self.exercised}


def compare_results(first: Result, second: Result, tolerance: float = TOLERANCE) -> ResultComparison:
    """Compare two results by signal over the time that both cover, at the times of the first.

    The second is interpolated where its times differ: linearly if the signal is a floating-point number, else by the
    value before. Units are converted to those of the first.

    Args:
        tolerance: share of a signal's spread in the first result (of its largest value where it is constant) that counts
            as equal.

    Raises:
        MisfitError: if the times do not overlap, or a signal changes its dimension.
    """
    if not len(first.time) or not len(second.time):
        raise MisfitError("one of the results to compare has no rows; run it again")
    start, stop = max(first.time[0], second.time[0]), min(first.time[-1], second.time[-1])
    if start > stop:
        raise MisfitError(
            f"the results to compare share no time: one covers {first.time[0]:g} to {first.time[-1]:g} s, "
            f"the other {second.time[0]:g} to {second.time[-1]:g} s"
        )
    here = (first.time >= start) & (first.time <= stop)
    time = first.time[here]
    if not len(time):
        raise MisfitError(f"the first result has no row between {start:g} and {stop:g} s, where both ran")
    others = {column.name: column for column in second.columns}
    found = []
    for column in first.columns:
        if column.name in others:
            mine = np.asarray(first[column.name][here], dtype=float)
            factor = _factor(others[column.name], column)
            found.append(_difference(column, time, mine, factor * _at(time, second, column), tolerance))
    found.sort(key=lambda s: -(s.largest / s.spread if s.spread else s.largest))
    return ResultComparison(
        tuple(found),
        tuple(name for name in first.names if name not in second),
        tuple(name for name in second.names if name not in first),
        float(start),
        float(stop),
        tolerance,
    )


def _factor(second: Column, first: Column) -> float:
    if second.unit == first.unit or not (second.unit and first.unit):
        return 1.0
    try:
        return conversion(second.unit, first.unit)
    except MisfitError as error:
        raise MisfitError(f"signal {first.name} cannot be compared: {error}") from error


def _at(time: NDArray[np.float64], result: Result, column: Column) -> NDArray[np.float64]:
    values = np.asarray(result[column.name], dtype=float)
    if len(values) == len(time) and np.array_equal(result.time, time):
        return values
    if column.stored_as == "float64":
        return np.interp(time, result.time, values)
    return values[np.searchsorted(result.time, time, side="right") - 1]


def _difference(
    column: Column, time: NDArray[np.float64], mine: NDArray[np.float64], other: NDArray[np.float64], tolerance: float
) -> SignalDifference:
    with np.errstate(invalid="ignore"):
        apart = np.abs(mine - other)
    apart[np.isnan(apart)] = np.inf
    apart[(mine == other) | (np.isnan(mine) & np.isnan(other))] = 0.0
    finite = mine[np.isfinite(mine)]
    spread = float(finite.max() - finite.min()) if finite.size else 0.0
    limit = tolerance * (spread or (float(np.abs(finite).max()) if finite.size else 0.0))
    parted = np.flatnonzero(apart > limit)
    k = int(apart.argmax())
    with np.errstate(over="ignore"):
        rms = float(np.sqrt(np.mean(apart**2)))
    parted_at = float(time[parted[0]]) if parted.size else None
    return SignalDifference(column.name, column.unit, float(apart[k]), float(time[k]), rms, spread, parted_at)


def _finite(value: float) -> float | None:
    return value if np.isfinite(value) else None
