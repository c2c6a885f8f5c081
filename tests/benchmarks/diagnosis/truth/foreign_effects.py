"""Effects that are in no library: what a diagnosis should call unknown."""

import numpy as np

from tests.benchmarks.diagnosis.truth.context import Context, Sized
from tests.benchmarks.diagnosis.truth.run import Injection


def position_dependent_friction(context: Context) -> Sized:
    """Dry friction whose size changes with position, from almost nothing to twice its mean."""
    wave, c = context.random.uniform(3, 8), context.machine.torque
    return lambda s: Injection("unknown", "joint1", {}, {"c1": s * c, "fpos": 0.95, "fwave": wave})


def coupling_friction(context: Context) -> Sized:
    """Dry friction of a joint that grows with the other joint's speed, as in a geared pair."""
    size = context.machine.torque / max(context.speed(1), 0.2)
    return lambda s: Injection("unknown", "joint1+joint2", {}, {"fother": s * size})


def external_push(context: Context) -> Sized:
    """Pushes at the wrist that no sensor sees."""
    every, length = context.random.uniform(1.7, 2.9), context.random.uniform(0.15, 0.4)
    angle = context.random.uniform(0, 2 * np.pi)
    values = {"pushangle": angle, "pushevery": every, "pushlength": length}
    return lambda s: Injection("unknown", "wrist", {}, {**values, "push": 0.1 * s})


def cubic_spring(context: Context) -> Sized:
    """Spring that hardens with the cube of the angle."""
    size = context.machine.torque / max(abs(context.quantile(0, 0.9)), 0.3) ** 3
    return lambda s: Injection("unknown", "joint1", {}, {"cube1": s * size})


def warming_friction(context: Context) -> Sized:
    """Viscous friction that falls to a tenth as a trial warms the bearing."""
    size = context.machine.torque / max(context.speed(0), 0.1)
    return lambda s: Injection("unknown", "joint1", {}, {"b1": s * size, "warm": 0.9, "warmtime": 2.0})


def uneven_rail(context: Context) -> Sized:
    """Dry friction of the cart's wheels that changes with its place on the rail."""
    wave = context.random.uniform(3, 8) / max(context.speed(1), 0.1)
    return lambda s: Injection("unknown", "slide1", {}, {"c2": 0.01 * s, "fpos": 0.95, "fwave": wave})


def clogging_outlet(context: Context) -> Sized:
    """The upper tank's outlet closes slowly in each trial, down to half its area."""
    length = context.runs[0].time[-1]
    return lambda s: Injection("unknown", "outlet1", {}, {"clog": 0.5 * s / (s + 50), "clogtime": length / 2})


def overflow(context: Context) -> Sized:
    """The upper tank spills above some level."""
    top = context.quantile(0, 0.98)

    def sized(s: float) -> Injection:
        return Injection("unknown", "tank1", {}, {"overflow": top * (1 - 0.8 * s / (s + 50))})

    return sized
