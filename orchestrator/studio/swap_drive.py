"""What drives the inputs that two FMUs have in common, so that a difference can show."""

import math
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from fmus.errors import MisfitError
from orchestrator.cosim.component import Port
from orchestrator.results import read_result

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


RECORDED = "as recorded in the file"
DRIVES: dict[str, Callable[[Sequence[Port], float], Waves]] = {
    "each moves within its range": within_ranges,
    "at their start values": lambda ports, stop: {},
    "a step to 1 after a tenth of the time": _steps,
    "a sine of amplitude 1, ten periods": _sines,
}
CHOICES = (*DRIVES, RECORDED)


def recorded(ports: Sequence[Port], file: Path) -> Waves:
    """Columns of a file that are named like inputs, or like the variable of a recorded run (`component.input`); time begins at 0.

    Raises:
        MisfitError: if it cannot be read, or has no such column.
    """
    found = read_result(file)
    columns = {name.partition(".")[2]: name for name in found.names} | {name: name for name in found.names}
    waves: Waves = {}
    for port in ports:
        if port.name in columns:
            values = np.asarray(found[columns[port.name]], dtype=float)
            kept = np.isfinite(values)
            waves[port.name] = {
                "kind": "table",
                "times": (found.time[kept] - found.time[0]).tolist(),
                "values": values[kept].tolist(),
            }
    if not waves:
        wanted = ", ".join(port.name for port in ports[:5]) or "none, neither FMU has an input that the other has"
        raise MisfitError(
            f"{file.name} has no column named like an input; expected a column time and some of: {wanted}"
        )
    return waves


def converted(wave: Mapping[str, Any], factor: float, offset: float) -> dict[str, Any]:
    """The same wave in another unit: `factor * value + offset`."""
    absolute = {name: factor * wave[name] + offset for name in ("to", "from", "offset") if name in wave}
    if wave["kind"] == "table":
        return {**wave, "values": [factor * value + offset for value in wave["values"]]}
    if wave["kind"] == "sine":
        return {**wave, "offset": offset, **absolute, "amplitude": factor * wave["amplitude"]}
    return {**wave, "from": offset, **absolute}
