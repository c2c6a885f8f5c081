"""Hidden effects outside the library, with the terms that are their simplest form; a case without an effect is a null."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from tests.benchmarks.laws.plants import PLANTS

Force = Callable[[float, Any, float, float, float], float]


@dataclass(frozen=True)
class Hidden:
    """A hidden effect at a plant: `force(t, q, v, u, z)` with position (or stored quantity) q, speed v, input u and memory z.

    `memory(t, q, v, u, z)` is the rate of z. `simplest` are the sets of terms that say it with fewest constants. With `whole`, q
    are all states; `at` are states at whose balances the force acts, with signs, without it the plant's `hit`.
    """

    plant: str
    name: str
    force: Force
    simplest: tuple[frozenset[str], ...] = ()
    memory: Force | None = None
    whole: bool = False
    at: Mapping[str, int] = field(default_factory=dict)


def _sign(v: float, sharp: float) -> float:
    return float(np.tanh(v / sharp))


def _one(*terms: str) -> tuple[frozenset[str], ...]:
    return (frozenset(terms),)


def _motions(plant: str, force: float, speed: float, way: float, duration: float) -> list[Hidden]:
    """Effects of motion in the scale of a plant: sizes of its forces, speeds, ways, and the duration of a trial."""
    f, s, w = force, speed, way
    sharp = 0.004 * s

    return [
        Hidden(plant, "dry friction growing with distance", lambda t, q, v, u, z: -f * (0.1 + 0.4 * abs(q) / w) * _sign(v, sharp), _one("dry", "dry_times_distance")),
        Hidden(plant, "damping growing with the square of the position", lambda t, q, v, u, z: -0.6 * f * (q / w) ** 2 * v / s, _one("viscous_times_square")),
        Hidden(plant, "friction in a zone", lambda t, q, v, u, z: -0.4 * f * np.exp(-(((q - 0.3 * w) / (0.25 * w)) ** 2)) * _sign(v, sharp), _one("dry_within")),
        Hidden(plant, "transmission loss", lambda t, q, v, u, z: -0.15 * abs(u) * _sign(v, sharp), _one("dry_times_size_of_u")),
        Hidden(plant, "slack cord", lambda t, q, v, u, z: -f * max(q / w - 0.4, 0.0) ** 2 * 2, _one("square_above")),
        Hidden(plant, "friction that warms away", lambda t, q, v, u, z: -0.35 * f * np.exp(-t / (0.3 * duration)) * _sign(v, sharp), _one("dry_fading")),
        Hidden(plant, "load picked up at a moment", lambda t, q, v, u, z: -0.25 * f * (t > 0.45 * duration), _one("constant_after")),
        Hidden(plant, "cubic spring that appears", lambda t, q, v, u, z: -0.4 * f * (q / w) ** 3 * (t > 0.6 * duration), _one("cubic_after")),
        Hidden(plant, "quintic spring", lambda t, q, v, u, z: -0.8 * f * (q / w) ** 5, _one("quintic")),
        Hidden(plant, "asymmetric damper", lambda t, q, v, u, z: -0.5 * f * max(v, 0.0) / s - 0.1 * f * min(v, 0.0) / s, (frozenset({"forward_damping", "backward_damping"}), frozenset({"viscous", "forward_damping"}), frozenset({"viscous", "backward_damping"}))),
        Hidden(plant, "eddy brake", lambda t, q, v, u, z: -0.8 * f * (v / s) / (1 + (v / (0.5 * s)) ** 2), _one("eddy_brake")),
        Hidden(plant, "friction with memory", lambda t, q, v, u, z: -0.3 * f * z / (0.05 * w), _one("pre_sliding"), lambda t, q, v, u, z: v - abs(v) * z / (0.05 * w)),
        Hidden(plant, "relaxing spring", lambda t, q, v, u, z: -0.5 * f * (q - z) / w, _one("relaxing_spring"), lambda t, q, v, u, z: (q - z) / (0.05 * duration)),
        Hidden(plant, "one-way square drag", lambda t, q, v, u, z: -0.5 * f * max(v / s, 0.0) ** 2, _one("forward_drag")),
    ]  # fmt: skip


def _rotations(plant: str, force: float, speed: float, duration: float) -> list[Hidden]:
    """Effects on a shaft that turns freely."""
    f, s = force, speed
    sharp = 0.004 * s
    return [
        Hidden(plant, "eddy brake", lambda t, q, v, u, z: -0.8 * f * (v / s) / (1 + (v / (0.4 * s)) ** 2), _one("eddy_brake")),
        Hidden(plant, "asymmetric drag", lambda t, q, v, u, z: -0.4 * f * max(v / s, 0.0) ** 2, _one("forward_drag")),
        Hidden(plant, "root damping", lambda t, q, v, u, z: -0.3 * f * np.sign(v) * np.sqrt(abs(v) / s), _one("root_damping")),
        Hidden(plant, "cubic damping", lambda t, q, v, u, z: -0.5 * f * (v / s) ** 3, _one("cubic_damping")),
        Hidden(plant, "transmission loss", lambda t, q, v, u, z: -0.2 * abs(u) * _sign(v, sharp), _one("dry_times_size_of_u")),
        Hidden(plant, "viscous friction that fades", lambda t, q, v, u, z: -0.4 * f * np.exp(-t / (0.3 * duration)) * v / s, _one("viscous_fading")),
        Hidden(plant, "rubbing from a moment on", lambda t, q, v, u, z: -0.2 * f * _sign(v, sharp) * (t > 0.5 * duration), _one("dry_after")),
        Hidden(plant, "damping above a speed", lambda t, q, v, u, z: -f * (max(v - 0.6 * s, 0.0) + min(v + 0.6 * s, 0.0)) / s, _one("late_damping")),
    ]  # fmt: skip


def _stores(plant: str, flow: float, middle: float, spread: float, duration: float) -> list[Hidden]:
    """Effects at a store: sizes of its flows, middle and half range of what is stored."""
    f, m, w = flow, middle, spread
    return [
        Hidden(plant, "loss with the cube", lambda t, q, v, u, z: -0.3 * f * (q / (abs(m) + w)) ** 3, _one("cubic_loss")),
        Hidden(plant, "loss above a value, power 1.5", lambda t, q, v, u, z: -0.5 * f * max((q - m - 0.1 * w) / w, 0.0) ** 1.5, _one("weir")),
        Hidden(plant, "exponential loss", lambda t, q, v, u, z: -0.3 * f * np.exp((q - m - w) / (0.4 * w)), _one("exponential_loss")),
        Hidden(plant, "loss in proportion to the input", lambda t, q, v, u, z: -0.25 * u * q / (abs(m) + w), _one("loss_times_of_u")),
        Hidden(plant, "loss that fades", lambda t, q, v, u, z: -0.35 * f * np.exp(-t / (0.3 * duration)) * q / (abs(m) + w), _one("loss_fading")),
        Hidden(plant, "leak from a moment on", lambda t, q, v, u, z: -0.3 * f * (t > 0.5 * duration) * q / (abs(m) + w), _one("loss_after")),
        Hidden(plant, "valve that opens", lambda t, q, v, u, z: -0.15 * f * (1 + np.tanh((q - m) / (0.15 * w))), (frozenset({"constant", "valve"}), frozenset({"constant_beyond"}))),
        Hidden(plant, "wall that takes up and gives back", lambda t, q, v, u, z: -0.5 * f * (q - z) / w, _one("absorbing_wall"), lambda t, q, v, u, z: (q - z) / (0.08 * duration)),
    ]  # fmt: skip


def _more(plant: str, name: str, force: Force, terms: str, memory: Force | None = None, **at: int) -> Hidden:
    """An effect at a plant of several states; `terms` are its simplest form, empty if the vocabulary has none."""
    return Hidden(plant, name, force, _one(*terms.split()) if terms else (), memory, True, at)


_OTHERS = (
    _more("motor", "fan with the power 1.5 of speed", lambda t, y, _, u, z: -0.05 * np.sign(y[1]) * (abs(y[1]) / 40) ** 1.5, "power_damping"),
    _more("motor", "winding that warms", lambda t, y, _, u, z: -0.05 * z * y[0], "loss_warming", lambda t, y, _, u, z: (y[0] ** 2 - z) / 0.6, i=1),
    _more("motor", "gear friction with current", lambda t, y, _, u, z: -0.012 * abs(y[0]) * _sign(y[1], 0.3), "dry_times_size_of_i"),
    _more("motor", "brush wear in time", lambda t, y, _, u, z: -0.3 * y[0] * (1 - np.exp(-t / 1.2)), "loss_building_up", None, i=1),
    _more("two masses", "asymmetric damper", lambda t, y, _, u, z: -3 * max(y[3], 0) - 0.6 * min(y[3], 0), "forward_damping backward_damping"),
    _more("two masses", "quintic spring between", lambda t, y, _, u, z: -4e5 * (y[2] - y[0]) ** 5, "quintic", None, v1=-1, v2=1),
    _more("two masses", "relaxing stop", lambda t, y, _, u, z: -80 * (max(y[2] - 0.05, 0) - z), "relaxing_stop", lambda t, y, _, u, z: (max(y[2] - 0.05, 0) - z) / 0.4),
    _more("room", "radiation about 20 K", lambda t, y, _, u, z: -2e-6 * ((y[0] + 20) ** 4 - 20**4), "", None, T1=1),
    _more("room", "conductance that fouls", lambda t, y, _, u, z: 4 * y[1] * (1 - np.exp(-t / 900)), "loss_building_up"),
    _more("room", "convection with the power 1.25", lambda t, y, _, u, z: -1.2 * np.sign(y[1]) * abs(y[1]) ** 1.25, "power_loss"),
    _more("two tanks", "weir", lambda t, y, _, u, z: -6e-3 * max(y[0] - 0.3, 0) ** 1.5, "weir"),
    _more("two tanks", "outlet that clogs", lambda t, y, _, u, z: 2.4e-4 * np.sqrt(max(y[0], 1e-6)) * (1 - np.exp(-t / 150)), "root_loss_building_up", None, h1=1, h2=-1),
    _more("two tanks", "hole above the floor", lambda t, y, _, u, z: -2.5e-4 * np.sqrt(max(y[1] - 0.12, 0)), "power_above", None, h2=1),
    _more("circuit", "diode", lambda t, y, _, u, z: -0.25 * np.exp((y[1] - 8) / 1.5), "exponential_loss"),
    _more("circuit", "varistor", lambda t, y, _, u, z: -0.3 * np.sinh(y[1] / 3) / np.sinh(2), "hyperbolic_loss"),
    _more("circuit", "resistor that warms", lambda t, y, _, u, z: -20 * z * y[0], "loss_warming", lambda t, y, _, u, z: (y[0] ** 2 - z) / 0.15, i=1),
    _more("cart", "cord that stiffens", lambda t, y, _, u, z: -900 * max(y[0] - 0.15, 0) ** 3, "cube_above"),
    _more("cart", "mass picked up", lambda t, y, _, u, z: -1.2 / 4.2 * (u - 18 * y[0] - 0.6 * y[1]) * (t > 5.4), "inertia_after"),
    _more("cart", "strip of friction", lambda t, y, _, u, z: -1.2 * (0.5 + 0.5 * np.tanh((y[0] - 0.1) / 0.01)) * _sign(y[1], 0.004), "dry_beyond"),
    _more("cart", "friction that wears off", lambda t, y, _, u, z: -1.5 * np.exp(-z / 3) * _sign(y[1], 0.004), "dry_wearing", lambda t, y, _, u, z: abs(y[1])),
    _more("cart", "rate limit of the drive", lambda t, y, _, u, z: z - u, "rate_limit_of_of_u", lambda t, y, _, u, z: float(np.clip((u - z) / 0.005, -12, 12))),
    _more("arm", "friction with memory", lambda t, y, _, u, z: -4 * z, "pre_sliding", lambda t, y, _, u, z: y[1] - abs(y[1]) * z / 0.02),
    _more("arm", "tissue that hardens", lambda t, y, _, u, z: -0.02 * (np.exp(max(y[0] - 0.1, 0) / 0.15) - 1), ""),
    _more("arm", "friction with gravity's load", lambda t, y, _, u, z: -0.12 * abs(np.cos(y[0])) * _sign(y[1], 0.01), ""),
)  # fmt: skip

CASES: tuple[Hidden, ...] = (
    *_motions("mass", 4.0, 1.0, 0.35, 6.0),
    *_motions("pendulum", 0.8, 1.8, 0.45, 6.0),
    *_rotations("rotor", 0.6, 8.0, 12.0),
    *_stores("tank", 0.002, 0.5, 0.2, 300.0),
    *_stores("oven", 120.0, 50.0, 20.0, 1800.0),
    *_stores("coil", 4.0, 0.0, 2.0, 1.2),
    *_stores("capacitor", 0.4, 1.0, 2.0, 3.0),
    *_OTHERS,
    *(Hidden(plant, "nothing", lambda t, q, v, u, z: 0.0) for plant in PLANTS),
)  # fmt: skip
