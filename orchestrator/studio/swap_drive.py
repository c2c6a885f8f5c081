"""What drives the inputs that two FMUs have in common, so that a difference can show."""

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from fmus.errors import MisfitError
from orchestrator.cosim.component import Port
from orchestrator.regress.wave import within_ranges
from orchestrator.results import read_result

Waves = dict[str, dict[str, Any]]


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
