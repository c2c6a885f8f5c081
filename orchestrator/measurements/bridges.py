"""Inputs across gaps of a record, so that a model that joins samples by straight lines is pushed by as much as the
machine was."""

import numpy as np
import scipy

from orchestrator.measurements.cleaning import GAP
from orchestrator.measurements.trial import Array


def bridged(time: Array, values: Array) -> Array:
    """Move the two samples at each gap so that the straight line between them has the mean of a smooth curve.

    The curve is the cubic spline through all samples. Both move by the same, and by so little less that the line over
    the gap and the two steps beside it together gain what the curve has above the line. Pieces of a signal with steps,
    such as a command, are left as they are: a curve through them means nothing.
    """
    steps = np.diff(time)
    usual = float(np.median(steps))
    gaps = np.flatnonzero(steps > GAP * usual)
    if not gaps.size or len(time) < 4 or _has_steps(values):
        return values
    curve, result = scipy.interpolate.CubicSpline(time, values), values.astype(float)
    for place in gaps:
        length = float(steps[place])
        excess = float(curve.integrate(time[place], time[place + 1])) - 0.5 * length * (
            values[place] + values[place + 1]
        )
        result[place : place + 2] += excess / (length + usual)
    return result


def _has_steps(values: Array) -> bool:
    """Whether most samples repeat the one before them."""
    return bool(np.mean(np.diff(values) == 0.0) > 0.5)
