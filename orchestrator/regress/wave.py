"""What drives the inputs of a model: generators by name, files, and both as a component of a system."""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from fmus.errors import MisfitError
from orchestrator.cosim.component import FLOATS, Port, Timed
from orchestrator.measurements.toml_values import number
from orchestrator.measurements.wording import nearest, shown

# Periods in the run of the first input, and how many more each further input has: no two move together.
PERIODS, MORE = 3.0, math.sqrt(2.0)
# The share of a range that is not declared: of the start value around it, or 1 where that is 0.
AROUND = 0.2
# Times this close, as a share of the step, are the same.
_SAME = 1e-9


@dataclass(frozen=True, eq=False)
class Wave:
    """Points of a signal: straight between them (or held), jumping where a time occurs twice; constant outside.

    `time` (n,) in s never falls; `values` (n,).
    """

    time: np.ndarray
    values: np.ndarray
    hold: bool = False

    def at(self, time: float) -> float:
        """The value at a time in s, after a jump where there is one.

        Example:
            >>> Wave(np.array([0.0, 1.0, 1.0]), np.array([0.0, 2.0, 5.0])).at(0.5)
            1.0
            >>> Wave(np.array([0.0, 1.0, 1.0]), np.array([0.0, 2.0, 5.0])).at(1.0)
            5.0
        """
        slack = _SAME * max(1.0, abs(time))
        after = int(np.searchsorted(self.time, time + slack, side="right"))
        if after == 0:
            return float(self.values[0])
        if after == len(self.time) or self.hold:
            return float(self.values[after - 1])
        width = self.time[after] - self.time[after - 1]
        share = min(max((time - self.time[after - 1]) / width, 0.0), 1.0)
        return float(self.values[after - 1] + share * (self.values[after] - self.values[after - 1]))


def generated(given: Mapping[str, Any], start: float, stop: float, step: float) -> Wave:
    """The wave that `{ kind = "step", at = 1.0, to = 2.0 }` and its like describe, sampled where it is curved.

    Kinds, with times in s, frequencies in Hz and phases in rad: `constant` (value), `step` (at, from, to), `ramp` (at,
    until, from, to), `pulse` (at, width, from, to), `sine` (amplitude, frequency, phase, offset, at), `chirp`
    (amplitude, from_hz, to_hz, offset), `random` (low, high, hold_s, seed: a new level every so often), `table` (times,
    values, hold).

    Args:
        given: the kind and its values.
        start: beginning of the run, in s.
        stop: its end, in s.
        step: its step, in s.

    Raises:
        MisfitError: if the kind or one of its keys is unknown or missing.
    """
    kind = given.get("kind", "")
    if kind not in _KINDS:
        raise MisfitError(f"kind = {shown(kind)}; {nearest(str(kind), _KINDS)}")
    make, defaults = _KINDS[kind]
    unknown = [key for key in given if key not in defaults and key != "kind"]
    if unknown:
        raise MisfitError(f"unknown key {shown(unknown[0])} of a {kind}; {nearest(unknown[0], defaults)}")
    missing = [key for key, value in defaults.items() if value is None and key not in given]
    if missing:
        raise MisfitError(f"a {kind} needs {', '.join(missing)}")
    values = {key: given.get(key, value) for key, value in defaults.items()}
    if kind != "table":
        for key, value in values.items():
            if number(value) is None:
                raise MisfitError(f"{key} = {shown(value)} of a {kind}; expected a finite number")
    return make(values, start, stop, step)


def _corners(*points: tuple[float, float]) -> Wave:
    return Wave(np.array([t for t, _ in points]), np.array([float(v) for _, v in points]))


def _constant(given: Mapping[str, Any], start: float, stop: float, step: float) -> Wave:
    return _corners((start, given["value"]))


def _step(given: Mapping[str, Any], start: float, stop: float, step: float) -> Wave:
    return _corners((given["at"], given["from"]), (given["at"], given["to"]))


def _ramp(given: Mapping[str, Any], start: float, stop: float, step: float) -> Wave:
    if not given["until"] > given["at"]:
        raise MisfitError(f"a ramp from {given['at']:g} s until {given['until']:g} s; expected it to end later")
    return _corners((given["at"], given["from"]), (given["until"], given["to"]))


def _pulse(given: Mapping[str, Any], start: float, stop: float, step: float) -> Wave:
    low, high, begin, end = given["from"], given["to"], given["at"], given["at"] + given["width"]
    if not given["width"] > 0.0:
        raise MisfitError(f"width = {given['width']:g} s of a pulse; expected a time above 0")
    return _corners((begin, low), (begin, high), (end, high), (end, low))


def _grid(start: float, stop: float, step: float) -> np.ndarray:
    return start + step * np.arange(math.ceil((stop - start) / step + _SAME) + 1)


def _sine(given: Mapping[str, Any], start: float, stop: float, step: float) -> Wave:
    time = _grid(start, stop, step)
    angle = 2.0 * math.pi * given["frequency"] * (time - given["at"]) + given["phase"]
    return Wave(time, given["offset"] + given["amplitude"] * np.where(time < given["at"], 0.0, np.sin(angle)))


def _chirp(given: Mapping[str, Any], start: float, stop: float, step: float) -> Wave:
    """Frequency rises linearly from one limit to the other over the whole run."""
    time = _grid(start, stop, step)
    since = time - start
    slope = (given["to_hz"] - given["from_hz"]) / (stop - start)
    angle = 2.0 * math.pi * (given["from_hz"] + 0.5 * slope * since) * since
    return Wave(time, given["offset"] + given["amplitude"] * np.sin(angle))


def _random(given: Mapping[str, Any], start: float, stop: float, step: float) -> Wave:
    if not given["hold_s"] > 0.0:
        raise MisfitError(f"hold_s = {given['hold_s']:g} s; expected a time above 0")
    time = start + given["hold_s"] * np.arange(math.ceil((stop - start) / given["hold_s"]) + 1)
    levels = np.random.default_rng(int(given["seed"])).uniform(given["low"], given["high"], len(time))
    return Wave(time, levels, hold=True)


def _table(given: Mapping[str, Any], start: float, stop: float, step: float) -> Wave:
    return checked_wave(_numbers(given, "times"), _numbers(given, "values"), hold=given["hold"] is True)


def _numbers(given: Mapping[str, Any], key: str) -> np.ndarray:
    found = [number(each) for each in given[key]] if isinstance(given[key], list) else []
    if not found or None in found:
        raise MisfitError(f"{key} = {shown(given[key])} of a table; expected a list of finite numbers")
    return np.array(found, dtype=float)


def checked_wave(time: np.ndarray, values: np.ndarray, hold: bool) -> Wave:
    """A wave of points from a user.

    Args:
        time: (n,) in s.
        values: (n,), in the input's unit.
        hold: whether a value stays until the next one.

    Raises:
        MisfitError: if the points cannot drive an input.
    """
    if len(time) != len(values):
        raise MisfitError(f"{len(time)} times and {len(values)} values; expected as many of either")
    if not len(time) or not (np.isfinite(time).all() and np.isfinite(values).all()):
        raise MisfitError("inputs have to be finite numbers at finite times, and at least one")
    back = np.flatnonzero(np.diff(time) < 0.0)
    if back.size:
        raise MisfitError(
            f"time {time[back[0] + 1]:.9g} s follows {time[back[0]]:.9g} s; expected times that never fall"
        )
    return Wave(time, values, hold)


_KINDS: dict[str, tuple[Callable[[Mapping[str, Any], float, float, float], Wave], dict[str, Any]]] = {
    "constant": (_constant, {"value": None}),
    "step": (_step, {"at": 0.0, "from": 0.0, "to": None}),
    "ramp": (_ramp, {"at": 0.0, "until": None, "from": 0.0, "to": None}),
    "pulse": (_pulse, {"at": 0.0, "width": None, "from": 0.0, "to": None}),
    "sine": (_sine, {"amplitude": None, "frequency": None, "phase": 0.0, "offset": 0.0, "at": 0.0}),
    "chirp": (_chirp, {"amplitude": None, "from_hz": None, "to_hz": None, "offset": 0.0}),
    "random": (_random, {"low": None, "high": None, "hold_s": None, "seed": 0}),
    "table": (_table, {"times": None, "values": None, "hold": False}),
}
GENERATORS = tuple(_KINDS)


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


def within_ranges(ports: Sequence[Port], stop: float) -> dict[str, dict[str, Any]]:
    """A sine for each input over its range, each with a frequency of its own."""
    waves = {}
    for place, port in enumerate(ports):
        middle, half = swing(port)
        frequency = (PERIODS + MORE * place) / stop
        waves[port.name] = {"kind": "sine", "amplitude": half, "frequency": frequency, "offset": middle}
    return waves


SOURCE = f"{__name__}:Drive"


class Drive(Timed):
    """Outputs follow waves; after a jump at a communication point they have the value that comes after it.

    Args:
        ports: outputs, each of the type and unit of what it drives.
        waves: by output.
    """

    def __init__(self, ports: Sequence[Port], waves: Mapping[str, Wave]) -> None:
        self.ports = tuple(ports)
        self.feedthrough: Mapping[str, Sequence[str]] = {port.name: () for port in ports}
        self._waves = dict(waves)
        self._kinds = {port.name: _kind(port) for port in ports}

    def set(self, names: Sequence[str], values: Sequence[Any]) -> None:
        """There are no inputs."""

    def get(self, names: Sequence[str]) -> list[Any]:
        """Values at the time reached."""
        return [self._kinds[name](self._waves[name].at(self._time)) for name in names]


def _kind(port: Port) -> Callable[[float], Any]:
    if port.type in FLOATS:
        return float
    return (lambda value: value != 0.0) if port.type == "Boolean" else round
