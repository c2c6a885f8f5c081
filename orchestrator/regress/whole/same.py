"""Whether two runs gave the same, to the bit or within a share of each signal's range."""

from collections.abc import Mapping

import numpy as np

from fmus.units import after_number
from orchestrator.regress.comparison import Signal


def difference(one: Mapping[str, Signal], other: Mapping[str, Signal], within: float = 0.0) -> str:
    """What differs first, in words; "" if nothing does.

    Args:
        within: share of a signal's range that two values may be apart; 0 asks for the same bits.
    """
    for name, signal in one.items():
        there = other[name]
        count = min(len(signal.time), len(there.time))
        if len(signal.time) != len(there.time):
            return f"{name} has {len(signal.time)} rows once and {len(there.time)} the other time"
        same = _same(signal.values[:count], there.values[:count], within)
        same &= signal.time[:count] == there.time[:count]
        if not same.all():
            row = int(np.argmin(same))
            apart = (
                float(np.nanmax(np.abs(signal.values - there.values))) if np.isfinite(signal.values).any() else np.nan
            )
            unit = after_number(signal.unit)
            return (
                f"{name} parts at {signal.time[row]:.9g} s: {signal.values[row]!r} and {there.values[row]!r}{unit}; "
                f"at most {apart:.3g}{unit} apart"
            )
    return ""


def _same(one: np.ndarray, other: np.ndarray, within: float) -> np.ndarray:
    if within == 0.0:
        return np.asarray(one.view(np.uint64) == other.view(np.uint64))
    finite = one[np.isfinite(one)]
    limit = within * (float(np.ptp(finite)) if finite.size else 0.0)
    return np.asarray((np.abs(one - other) <= limit) | (np.isnan(one) & np.isnan(other)))
