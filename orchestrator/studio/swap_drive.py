"""What drives the inputs that two FMUs have in common, so that a difference can show."""

import math
from collections.abc import Callable, Sequence
from typing import Any

from orchestrator.cosim.component import Port

Waves = dict[str, dict[str, Any]]
# Periods in the run of the first input, and how many more each further input has: no two move together.
PERIODS, MORE = 3.0, math.sqrt(2.0)
# The share of a range that is not declared: of the start value around it, or 1 where that is 0.
AROUND = 0.2


def swing(port: Port) -> tuple[float, float]:
    """Middle and half of the range in which an input is moved: the declared one, else around its nominal or start value.

    >>> swing(Port("a", "input", minimum=0.0, maximum=1.0))
    (0.5, 0.5)
    >>> swing(Port("L", "input", start=0.18))[0]
    0.18
    """
    start = float(port.start or 0.0)
    if port.minimum is not None and port.maximum is not None and math.isfinite(port.maximum - port.minimum):
        return (port.minimum + port.maximum) / 2, (port.maximum - port.minimum) / 2
    half = abs(port.nominal) if port.nominal else AROUND * abs(start) or 1.0
    middle = start
    if port.minimum is not None and middle - half < port.minimum:
        middle = port.minimum + half
    if port.maximum is not None and middle + half > port.maximum:
        middle = port.maximum - half
    return middle, half


def within_ranges(ports: Sequence[Port], stop: float) -> Waves:
    """A sine for each input over its range, each with a frequency of its own."""
    waves: Waves = {}
    for place, port in enumerate(ports):
        middle, half = swing(port)
        frequency = (PERIODS + MORE * place) / stop
        waves[port.name] = {"kind": "sine", "amplitude": half, "frequency": frequency, "offset": middle}
    return waves


def _steps(ports: Sequence[Port], stop: float) -> Waves:
    return {port.name: {"kind": "step", "at": 0.1 * stop, "to": 1.0} for port in ports}


def _sines(ports: Sequence[Port], stop: float) -> Waves:
    return {port.name: {"kind": "sine", "amplitude": 1.0, "frequency": 10.0 / stop} for port in ports}


DRIVES: dict[str, Callable[[Sequence[Port], float], Waves]] = {
    "each moves within its range": within_ranges,
    "at their start values": lambda ports, stop: {},
    "a step to 1 after a tenth of the time": _steps,
    "a sine of amplitude 1, ten periods": _sines,
}
