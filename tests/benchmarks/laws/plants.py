"""Plants without slots in six domains: the model as a user writes it, and its rates in plain numbers for the truth."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

State = Sequence[float]
Forces = Mapping[str, float]


@dataclass(frozen=True)
class Plant:
    """A plant whose model lacks a force.

    `states` are (name, unit, start), `outputs` those that are measured. `rates(u, y, f)` are the derivatives at input `u` with
    missing forces `f` by the state whose balance they act at, usually `hit`. The input is a sum of waves of amplitude
    `amplitude` about `middle`, between `slow` and `fast` Hz, at least `low`; `noise` is of the sensors, as a share of the spread.
    """

    model: str
    parameters: Mapping[str, tuple[float, str]]
    input: tuple[str, str]
    states: tuple[tuple[str, str, float], ...]
    outputs: tuple[str, ...]
    equations: tuple[str, ...]
    rates: Callable[[float, State, Forces], list[float]]
    hit: str
    step: float
    middle: float
    amplitude: float
    slow: float
    fast: float
    low: float = -np.inf
    noise: float = 0.001

    @property
    def names(self) -> list[str]:
        """Names of the states."""
        return [name for name, _, _ in self.states]

    @property
    def text(self) -> str:
        """The model as its user writes it."""
        lines = [f"  parameter Real {name}{_unit(unit)} = {value};" for name, (value, unit) in self.parameters.items()]
        lines.append(f"  input Real {self.input[0]}{_unit(self.input[1])};")
        for name, unit, start in self.states:
            kind = "output " if name in self.outputs else ""
            lines.append(f'  {kind}Real {name}(unit="{unit}", start={start}, fixed=true);')
        equations = [f"  {equation};" for equation in self.equations]
        return "\n".join([f"model {self.model}", *lines, "equation", *equations, f"end {self.model};", ""])


def _unit(unit: str) -> str:
    return f'(unit="{unit}")' if unit else ""


def _root(value: float) -> float:
    return float(np.sqrt(max(value, 1e-6)))


PLANTS: Mapping[str, Plant] = {
    "mass": Plant(
        "Mass", {"m": (2, "kg"), "k": (30, "N/m")}, ("u", "N"), (("x", "m", 0), ("v", "m/s", 0)), ("x",),
        ("der(x) = v", "m*der(v) = u - k*x"),
        lambda u, y, f: [y[1], (u - 30 * y[0] + f.get("v", 0)) / 2],
        "v", 0.01, 0, 4, 0.2, 3,
    ),
    "pendulum": Plant(
        "Pendulum", {"J": (0.2, "kg.m2"), "G": (3, "N.m")}, ("u", "N.m"), (("phi", "rad", 0), ("w", "rad/s", 0)), ("phi",),
        ("der(phi) = w", "J*der(w) = u - G*sin(phi)"),
        lambda u, y, f: [y[1], (u - 3 * np.sin(y[0]) + f.get("w", 0)) / 0.2],
        "w", 0.01, 0, 0.8, 0.2, 2,
    ),
    "rotor": Plant(
        "Rotor", {"J": (0.05, "kg.m2")}, ("u", "N.m"), (("phi", "rad", 0), ("w", "rad/s", 0)), ("w",),
        ("der(phi) = w", "J*der(w) = u"),
        lambda u, y, f: [y[1], (u + f.get("w", 0)) / 0.05],
        "w", 0.02, 0, 0.6, 0.1, 1.5,
    ),
    "tank": Plant(
        "Tank", {"A": (0.05, "m2"), "R": (0.004, "m2/s")}, ("u", "m3/s"), (("h", "m", 0.3),), ("h",),
        ("A*der(h) = u - R*h",),
        lambda u, y, f: [(u - 0.004 * y[0] + f.get("h", 0)) / 0.05],
        "h", 0.5, 0.002, 0.0012, 0.003, 0.08, 0,
    ),
    "oven": Plant(
        "Oven", {"C": (500, "J/K"), "G": (2, "W/K")}, ("u", "W"), (("T", "K", 20),), ("T",),
        ("C*der(T) = u - G*T",),
        lambda u, y, f: [(u - 2 * y[0] + f.get("T", 0)) / 500],
        "T", 3, 120, 60, 0.0005, 0.01,
    ),
    "coil": Plant(
        "Coil", {"L": (0.05, "H"), "R": (1.5, "Ohm")}, ("u", "V"), (("i", "A", 0),), ("i",),
        ("L*der(i) = u - R*i",),
        lambda u, y, f: [(u - 1.5 * y[0] + f.get("i", 0)) / 0.05],
        "i", 0.002, 0, 5, 1, 15,
    ),
    "capacitor": Plant(
        "Capacitor", {"C": (0.02, "F"), "g": (0.05, "S")}, ("u", "A"), (("V", "V", 0),), ("V",),
        ("C*der(V) = u - g*V",),
        lambda u, y, f: [(u - 0.05 * y[0] + f.get("V", 0)) / 0.02],
        "V", 0.005, 0.1, 0.4, 0.2, 5,
    ),
    # ---- plants with more states, damping of their own and noisier sensors
    "motor": Plant(
        "Motor", {"L": (0.01, "H"), "R": (1.2, "Ohm"), "K": (0.08, "V.s/rad"), "J": (4e-4, "kg.m2")}, ("u", "V"),
        (("i", "A", 0), ("w", "rad/s", 0)), ("i", "w"),
        ("L*der(i) = u - R*i - K*w", "J*der(w) = K*i"),
        lambda u, y, f: [(u - 1.2 * y[0] - 0.08 * y[1] + f.get("i", 0)) / 0.01, (0.08 * y[0] + f.get("w", 0)) / 4e-4],
        "w", 0.005, 0, 6, 0.1, 4, noise=0.003,
    ),
    "two masses": Plant(
        "Two", {"m1": (1.5, "kg"), "m2": (0.8, "kg"), "k": (120, "N/m"), "k0": (40, "N/m"), "d": (0.8, "N.s/m")}, ("u", "N"),
        (("x1", "m", 0), ("v1", "m/s", 0), ("x2", "m", 0), ("v2", "m/s", 0)), ("x1", "x2"),
        ("der(x1) = v1", "der(x2) = v2", "m1*der(v1) = u - k0*x1 - k*(x1 - x2) - d*(v1 - v2)",
         "m2*der(v2) = k*(x1 - x2) + d*(v1 - v2)"),
        lambda u, y, f: [
            y[1], (u - 40 * y[0] - 120 * (y[0] - y[2]) - 0.8 * (y[1] - y[3]) + f.get("v1", 0)) / 1.5,
            y[3], (120 * (y[0] - y[2]) + 0.8 * (y[1] - y[3]) + f.get("v2", 0)) / 0.8,
        ],
        "v2", 0.01, 0, 6, 0.2, 2.5, noise=0.003,
    ),
    "room": Plant(
        "Room", {"C1": (300, "J/K"), "C2": (1200, "J/K"), "G": (6, "W/K"), "Ga": (4, "W/K")}, ("u", "W"),
        (("T1", "K", 0), ("T2", "K", 0)), ("T1", "T2"),
        ("C1*der(T1) = u - G*(T1 - T2)", "C2*der(T2) = G*(T1 - T2) - Ga*T2"),
        lambda u, y, f: [(u - 6 * (y[0] - y[1]) + f.get("T1", 0)) / 300, (6 * (y[0] - y[1]) - 4 * y[1] + f.get("T2", 0)) / 1200],
        "T2", 4, 150, 80, 0.0004, 0.01, noise=0.003,
    ),
    "two tanks": Plant(
        "Pair", {"A1": (0.02, "m2"), "A2": (0.03, "m2"), "a": (6e-4, ""), "b": (7e-4, "")}, ("u", "m3/s"),
        (("h1", "m", 0.25), ("h2", "m", 0.2)), ("h1", "h2"),
        ("A1*der(h1) = u - a*sqrt(max(h1, 1e-6))", "A2*der(h2) = a*sqrt(max(h1, 1e-6)) - b*sqrt(max(h2, 1e-6))"),
        lambda u, y, f: [(u - 6e-4 * _root(y[0]) + f.get("h1", 0)) / 0.02, (6e-4 * _root(y[0]) - 7e-4 * _root(y[1]) + f.get("h2", 0)) / 0.03],
        "h1", 1, 3.2e-4, 1.3e-4, 0.002, 0.03, 0, noise=0.003,
    ),
    "circuit": Plant(
        "Circuit", {"L": (0.02, "H"), "R": (0.6, "Ohm"), "C": (1e-3, "F"), "g": (0.01, "S")}, ("u", "V"),
        (("i", "A", 0), ("V", "V", 0)), ("V",),
        ("L*der(i) = u - R*i - V", "C*der(V) = i - g*V"),
        lambda u, y, f: [(u - 0.6 * y[0] - y[1] + f.get("i", 0)) / 0.02, (y[0] - 0.01 * y[1] + f.get("V", 0)) / 1e-3],
        "V", 0.001, 0, 5, 2, 40, noise=0.003,
    ),
    "cart": Plant(
        "Cart", {"m": (3, "kg"), "k": (18, "N/m"), "d": (0.6, "N.s/m")}, ("u", "N"), (("s", "m", 0), ("v", "m/s", 0)), ("s",),
        ("der(s) = v", "m*der(v) = u - k*s - d*v"),
        lambda u, y, f: [y[1], (u - 18 * y[0] - 0.6 * y[1] + f.get("v", 0)) / 3],
        "v", 0.02, 0, 5, 0.1, 1.5, noise=0.003,
    ),
    "arm": Plant(
        "Arm", {"J": (0.08, "kg.m2"), "G": (1.2, "N.m"), "d": (0.02, "N.m.s/rad")}, ("u", "N.m"),
        (("a", "rad", 0.3), ("w", "rad/s", 0)), ("a",),
        ("der(a) = w", "J*der(w) = u - G*sin(a) - d*w"),
        lambda u, y, f: [y[1], (u - 1.2 * np.sin(y[0]) - 0.02 * y[1] + f.get("w", 0)) / 0.08],
        "w", 0.01, 0, 0.5, 0.2, 2, noise=0.003,
    ),
}  # fmt: skip
