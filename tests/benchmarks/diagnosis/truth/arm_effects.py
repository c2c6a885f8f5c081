"""Effects that only the arm has: its wrist, plane, muscles and stimulation."""

import numpy as np

from tests.benchmarks.diagnosis.truth.context import Context, Sized
from tests.benchmarks.diagnosis.truth.run import Injection, Series
from tests.benchmarks.diagnosis.truth.signal_effects import lagged

_MUSCLES = "+".join(f"muscle{k}" for k in range(1, 7))


def _per_channel(change: Series) -> Series:
    """A change of the six activations; the forces stay."""
    return lambda time, u: np.hstack([change(time, u[:, :6]), u[:, 6:]])


def payload(context: Context) -> Sized:
    """Point mass at the wrist."""
    return lambda s: Injection("payload", "wrist", {"mass": 0.02 * s}, {"mw": 0.02 * s})


def wrist_drag(context: Context) -> Sized:
    """Force against the wrist's motion, with the square of its speed."""
    return lambda s: Injection("quadratic_drag", "wrist", {"c": 0.5 * s}, {"dw": 0.5 * s})


def gravity_tilt(context: Context) -> Sized:
    """The plane is not level; a double pendulum's is turned."""
    angle = context.random.uniform(0, 2 * np.pi)
    x, y = 0.005 * np.cos(angle), 0.005 * np.sin(angle)
    return lambda s: Injection("gravity_tilt", "base", {"gx": x * s, "gy": y * s}, {"gx": x * s, "gy": y * s})


def wrist_force(context: Context) -> Sized:
    """Steady force at the wrist."""
    angle = context.random.uniform(0, 2 * np.pi)
    x, y = 0.03 * np.cos(angle), 0.03 * np.sin(angle)
    return lambda s: Injection(
        "constant_force", "wrist", {"f0[1]": x * s, "f0[2]": y * s}, {"fx0": x * s, "fy0": y * s}
    )


def activation_dynamics(context: Context) -> Sized:
    """Activations follow the commands with a lag, slower on the way down."""
    ratio = context.random.uniform(1.2, 2.0)

    def sized(s: float) -> Injection:
        up, down = 0.004 * s, 0.004 * s * ratio
        return Injection(
            "activation_dynamics",
            _MUSCLES,
            {"tauUp": up, "tauDown": down},
            command=_per_channel(lambda t, a: lagged(t, a, up, down)),
        )

    return sized


def recruitment_curve(context: Context) -> Sized:
    """Dead zone and early saturation between command and activation."""

    def sized(s: float) -> Injection:
        threshold, full = 0.3 * s / (s + 100), 1 - 0.3 * s / (s + 100)
        return Injection(
            "recruitment_curve",
            _MUSCLES,
            {"threshold": threshold, "full": full},
            command=_per_channel(lambda t, a: np.clip((a - threshold) / (full - threshold), 0, 1)),
        )

    return sized


def fatigue(context: Context) -> Sized:
    """Capacity falls with activation and recovers at rest."""
    ratio = context.random.uniform(1.5, 3.0)

    def sized(s: float) -> Injection:
        falls, recovers = 1000.0 / s, ratio * 1000.0 / s

        def tired(time: np.ndarray, a: np.ndarray) -> np.ndarray:
            capacity, left, step = np.ones(6), np.empty_like(a), time[1] - time[0]
            for k, now in enumerate(a):
                left[k] = capacity
                capacity = capacity + step * (-now * capacity / falls + (1 - now) * (1 - capacity) / recovers)
            return a * left

        return Injection("fatigue", _MUSCLES, {"TFatigue": falls, "TRecovery": recovers}, command=_per_channel(tired))

    return sized


def muscle_weakness(context: Context, muscle: int | None = None) -> Sized:
    """One muscle's active force is off by a factor."""
    k = int(context.random.integers(6)) if muscle is None else muscle

    def sized(s: float) -> Injection:
        factor = np.ones(6)
        factor[k] = 1 - s / (s + 200)
        return Injection(
            "muscle_weakness",
            f"muscle{k + 1}",
            {f"factor[{k + 1}]": float(factor[k])},
            command=_per_channel(lambda t, a: a * factor),
        )

    return sized


def moment_arm_error(context: Context) -> Sized:
    """One muscle's moment arms are off by a factor, in torque and in length."""
    k, sign = int(context.random.integers(6)), context.random.choice([-1.0, 1.0])

    def sized(s: float) -> Injection:
        ratio = 1 + sign * 0.6 * s / (s + 200)
        return Injection("moment_arm_error", f"muscle{k + 1}", {f"ratio[{k + 1}]": ratio}, {f"ma{k + 1}": ratio})

    return sized


def stimulation_crosstalk(context: Context) -> Sized:
    """A share of one channel's command reaches another muscle."""
    i, j = context.random.choice(6, 2, replace=False)

    def sized(s: float) -> Injection:
        gain = np.zeros((6, 6))
        gain[i, j] = 0.002 * s
        return Injection(
            "stimulation_crosstalk",
            f"channel{i + 1}->muscle{j + 1}",
            {f"gain[{i + 1},{j + 1}]": 0.002 * s},
            command=_per_channel(lambda t, a: np.minimum(1, a + a @ gain)),
        )

    return sized


def stretch_reflex(context: Context) -> Sized:
    """Activation in proportion to the speed of lengthening, later by an exact delay."""
    delay = context.random.uniform(0.025, 0.05)
    return lambda s: Injection(
        "stretch_reflex", _MUSCLES, {"gain": 0.002 * s, "delay": delay}, {"rgain": 0.002 * s, "rdelay": delay}
    )


def series_elasticity(context: Context) -> Sized:
    """Tendons that stretch by `strain` of their slack length at the muscle's largest force."""

    def sized(s: float) -> Injection:
        strain = 0.03 + 0.002 * s  # stiffer tendons hide behind the solver's step
        return Injection("series_elasticity", _MUSCLES, {"strain": strain}, {"strain": strain})

    return sized


def force_sensor_gain(context: Context) -> Sized:
    """Scale error of the force sensor, by a factor of five at most: one that reads less no longer records the force."""
    sign = context.random.choice([-1.0, 1.0])

    def sized(s: float) -> Injection:
        gain = float(np.exp(sign * min(0.01 * s, np.log(5.0))))
        return Injection(
            "force_sensor_gain",
            "sensor:force",
            {"gain": gain},
            reading=lambda t, u: np.hstack([u[:, :6], gain * u[:, 6:]]),
        )

    return sized


def force_sensor_offset(context: Context) -> Sized:
    """Zero error of the force sensor."""
    angle = context.random.uniform(0, 2 * np.pi)
    way = 0.03 * np.array([np.cos(angle), np.sin(angle)])

    def sized(s: float) -> Injection:
        return Injection(
            "force_sensor_offset",
            "sensor:force",
            {"offset[1]": float(way[0] * s), "offset[2]": float(way[1] * s)},
            reading=lambda t, u: np.hstack([u[:, :6], u[:, 6:] + way * s]),
        )

    return sized
