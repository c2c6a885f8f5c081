"""Effects on commands and sensors: what acts is not what was commanded, what is read is not what is."""

from dataclasses import dataclass

import numpy as np
from scipy import signal
from scipy.interpolate import CubicSpline

from tests.benchmarks.diagnosis.truth.context import Context, Sized
from tests.benchmarks.diagnosis.truth.run import Injection, Series

# Parts of a sample interval in which a slow sensor is followed.
_FINER = 16
# Clocks of inputs and outputs may be a sample apart; a delay or lag that is no longer than that is no effect.
_SEEN_SAMPLES = 1.5


def stimulation_delay(context: Context) -> Sized:
    """The commands act later."""
    machine, slow = context.machine, context.machine.slow
    several = [i for i, name in enumerate(machine.inputs) if name in machine.commands] or list(
        range(len(machine.inputs))
    )

    def later(by: float) -> Series:
        def command(time: np.ndarray, u: np.ndarray) -> np.ndarray:
            moved = u.copy()
            for i in several:
                moved[:, i] = np.interp(time - by, time, u[:, i])
            return moved

        return command

    def sized(s: float) -> Injection:
        delay = _SEEN_SAMPLES / machine.rate_hz + 0.005 * slow * s
        return Injection("stimulation_delay", _path(context), {"T": delay}, command=later(delay))

    return sized


def saturation(context: Context) -> Sized:
    """The command is cut off above a ceiling."""
    machine = context.machine
    columns = [i for i, name in enumerate(machine.inputs) if name in machine.commands] or [0]
    peak = max(float(np.abs(run.recorded[:, columns]).max()) for run in context.runs)
    low = -np.inf if machine.name in ("drive", "two-mass", "cart") else 0.0

    def cut(ceiling: float) -> Series:
        def command(time: np.ndarray, u: np.ndarray) -> np.ndarray:
            cut_off = u.copy()
            cut_off[:, columns] = np.clip(u[:, columns], max(low, -ceiling), ceiling)
            return cut_off

        return command

    def sized(s: float) -> Injection:
        ceiling = peak * (1 - 0.9 * s / (s + 10))
        return Injection("saturation", _path(context), {"ceiling": ceiling}, command=cut(ceiling))

    return sized


def joint_offset(context: Context) -> Sized:
    """Zero error of one encoder or level sensor."""
    # Where a cart's rail begins changes nothing.
    sensor, sign = _sensor(context, rail=False), context.random.choice([-1.0, 1.0])

    def sized(s: float) -> Injection:
        shift = np.zeros(len(context.machine.outputs))
        shift[sensor.column] = sign * 1e-3 * s
        name = f"offset[{sensor.number}]"
        return Injection("joint_offset", sensor.site, {name: sign * 1e-3 * s}, sensor=lambda t, y: y + shift)

    return sized


def joint_scale(context: Context) -> Sized:
    """Scale error of one encoder or level sensor."""
    sensor, sign = _sensor(context), context.random.choice([-1.0, 1.0])

    def sized(s: float) -> Injection:
        scale = np.ones(len(context.machine.outputs))
        scale[sensor.column] = 1 + sign * 1e-3 * s
        named = {f"scale[{sensor.number}]": float(scale[sensor.column])}
        return Injection("joint_scale", sensor.site, named, sensor=lambda t, y: y * scale)

    return sized


def sensor_lag(context: Context) -> Sized:
    """Readings that follow the motion with a first-order lag: of all sensors that are alike."""
    machine = context.machine
    sensor = _sensor(context)
    alike = [sensor.column] if machine.name == "cart" else list(range(len(machine.outputs)))
    site = "+".join(f"sensor:{list(machine.outputs)[k]}" for k in alike)

    def late(by: float) -> Series:
        def reading(time: np.ndarray, y: np.ndarray) -> np.ndarray:
            read = y.copy()
            read[:, alike] = slow_reading(time, y[:, alike], by)
            return read

        return reading

    def sized(s: float) -> Injection:
        lag = _SEEN_SAMPLES / machine.rate_hz + 0.002 * machine.slow * s
        return Injection("sensor_lag", site, {"tau": lag}, sensor=late(lag))

    return sized


def slow_reading(time: np.ndarray, motion: np.ndarray, lag: float) -> np.ndarray:
    """What a sensor of first order shows (n, k) of a smooth motion, from rest: a cubic spline through it, taken finely.

    Were the motion straight between its samples, a lag of six of them would read as one that is 0.2 % longer.
    """
    fine = np.linspace(time[0], time[-1], _FINER * (len(time) - 1) + 1)
    numerator, denominator, _ = signal.cont2discrete(([1.0], [lag, 1.0]), fine[1] - fine[0], "foh")
    moved = CubicSpline(time, motion)(fine) - motion[0]
    return motion[0] + signal.lfilter(numerator[0], denominator, moved, axis=0)[::_FINER]


def lagged(time: np.ndarray, followed: np.ndarray, rising: float, falling: float) -> np.ndarray:
    """First-order lag (n, k) of a series, exact for inputs that are straight between samples; the start is at rest."""
    step = time[1] - time[0]
    result, now = np.empty_like(followed), followed[0].copy()
    result[0] = now
    slopes, middle = np.diff(followed, axis=0) / step, 0.5 * (followed[1:] + followed[:-1])
    kept = np.exp(-step / rising), np.exp(-step / falling)
    for k, slope in enumerate(slopes):
        up = middle[k] > now
        behind = slope * np.where(up, rising, falling)
        now = followed[k + 1] - behind + (now - followed[k] + behind) * np.where(up, *kept)
        result[k + 1] = now
    return result


@dataclass(frozen=True)
class _Sensor:
    """One sensor: its place among the outputs, its number among those of its kind, and its site."""

    column: int
    number: int
    site: str


def _sensor(context: Context, *, rail: bool = True) -> _Sensor:
    names = list(context.machine.outputs)
    column = int(context.random.integers(len(names)))
    if context.machine.name != "cart":
        return _Sensor(column, column + 1, f"sensor:{names[column]}")
    column = column if rail else names.index("theta")
    return _Sensor(column, 1, f"sensor:{names[column]}")


def _path(context: Context) -> str:
    return (
        "+".join(f"muscle{k}" for k in range(1, 7))
        if context.machine.name == "arm"
        else next(iter(context.machine.inputs))
    )
