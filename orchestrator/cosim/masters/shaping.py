"""Inputs over a step that are not held: extrapolated along a line, or smoothed."""

import math

from orchestrator.cosim.masters.carrying import Carrying
from orchestrator.cosim.masters.operations import Shape


class Shaper:
    """What components get as inputs while they step, instead of the values at the beginning of the step.

    Args:
        extrapolate: along the line through the last two points. A component that interpolates its inputs gets the slope,
            any other the value in the middle of the step, which serves a step of order two as well.
        smoothing: time constant in s of a first-order lag that inputs pass, 0 for none.
    """

    def __init__(self, extrapolate: bool, smoothing: float) -> None:
        self.extrapolate, self.smoothing = extrapolate, smoothing
        self._before: dict[int, tuple[float, float]] = {}
        self._smooth: dict[int, float] = {}

    def apply(self, coupling: Carrying, operation: Shape, time: float, size: float) -> None:
        """Set the inputs of a component for the step from `time`."""
        component = coupling.components[operation.component]
        kept, slopes = [], []
        for slot in operation.slots:
            for place in range(slot.first, slot.first + slot.port.size):
                value = coupling.values[place]
                kept.append((place, value))
                smooth = self._smoothed(place, value, size)
                last_time, last = self._before.get(place, (time, smooth))
                slopes.append((smooth - last) / (time - last_time) if self.extrapolate and time > last_time else 0.0)
                self._before[place] = (time, smooth)
                coupling.values[place] = smooth
        interpolates = getattr(component, "interpolates_inputs", False)
        if not interpolates:
            for (place, _), slope in zip(kept, slopes, strict=True):
                coupling.values[place] += 0.5 * size * slope
        coupling.write(operation, time)
        if interpolates and self.extrapolate:
            component.slopes([slot.port.name for slot in operation.slots], slopes)  # type: ignore[attr-defined]
        for place, value in kept:
            coupling.values[place] = value

    def _smoothed(self, place: int, value: float, size: float) -> float:
        if self.smoothing <= 0.0:
            return value
        before = self._smooth.get(place, value)
        self._smooth[place] = before + (value - before) * -math.expm1(-size / self.smoothing)
        return self._smooth[place]
