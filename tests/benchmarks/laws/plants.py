"""Plants without slots in four domains: the model as a user writes it, and its rates in plain numbers for the truth."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

State = Sequence[float]


@dataclass(frozen=True)
class Plant:
    """A plant whose model lacks a force.

    `rates(u, y, f)` are the derivatives of the states `y` at input `u` with a missing force `f` at the balance of state number
    `hit`. The input is a sum of waves of amplitude `amplitude` about `middle`, between `slow` and `fast` Hz; `noise` is of the
    measured state number 0, as a share of its spread. `coordinates` name what a missing force may depend on, by state number.
    """

    model: str
    text: str
    input: tuple[str, str]
    output: tuple[str, str]
    rates: Callable[[float, State, float], list[float]]
    start: tuple[float, ...]
    states: tuple[str, ...]
    hit: int
    step: float
    middle: float
    amplitude: float
    slow: float
    fast: float
    noise: float = 0.001


def _text(name: str, unit: str, body: str, output: str) -> str:
    return f'model {name}\n  input Real u(unit="{unit}");\n{body}end {name};\n'


MASS = Plant(
    "Mass",
    _text(
        "Mass",
        "N",
        '  parameter Real m(unit="kg") = 2.0;\n  parameter Real k(unit="N/m") = 30.0;\n'
        '  output Real x(unit="m", start=0, fixed=true);\n  Real v(unit="m/s", start=0, fixed=true);\n'
        "equation\n  der(x) = v;\n  m*der(v) = u - k*x;\n",
        "x",
    ),
    ("u", "N"),
    ("x", "m"),
    lambda u, y, f: [y[1], (u - 30.0 * y[0] + f) / 2.0],
    (0.0, 0.0),
    ("x", "v"),
    1,
    0.01,
    0.0,
    4.0,
    0.2,
    3.0,
)
PENDULUM = Plant(
    "Pendulum",
    _text(
        "Pendulum",
        "N.m",
        '  parameter Real J(unit="kg.m2") = 0.2;\n  parameter Real G(unit="N.m") = 3.0;\n'
        '  output Real phi(unit="rad", start=0, fixed=true);\n  Real w(unit="rad/s", start=0, fixed=true);\n'
        "equation\n  der(phi) = w;\n  J*der(w) = u - G*sin(phi);\n",
        "phi",
    ),
    ("u", "N.m"),
    ("phi", "rad"),
    lambda u, y, f: [y[1], (u - 3.0 * np.sin(y[0]) + f) / 0.2],
    (0.0, 0.0),
    ("phi", "w"),
    1,
    0.01,
    0.0,
    0.8,
    0.2,
    2.0,
)
ROTOR = Plant(
    "Rotor",
    _text(
        "Rotor",
        "N.m",
        '  parameter Real J(unit="kg.m2") = 0.05;\n  output Real w(unit="rad/s", start=0, fixed=true);\n'
        '  Real phi(unit="rad", start=0, fixed=true);\nequation\n  der(phi) = w;\n  J*der(w) = u;\n',
        "w",
    ),
    ("u", "N.m"),
    ("w", "rad/s"),
    lambda u, y, f: [(u + f) / 0.05, y[0]],
    (0.0, 0.0),
    ("w", "phi"),
    0,
    0.02,
    0.0,
    0.6,
    0.1,
    1.5,
)
TANK = Plant(
    "Tank",
    _text(
        "Tank",
        "m3/s",
        '  parameter Real A(unit="m2") = 0.05;\n  parameter Real R(unit="m2/s") = 0.004;\n'
        '  output Real h(unit="m", start=0.3, fixed=true);\nequation\n  A*der(h) = u - R*h;\n',
        "h",
    ),
    ("u", "m3/s"),
    ("h", "m"),
    lambda u, y, f: [(u - 0.004 * y[0] + f) / 0.05],
    (0.3,),
    ("h",),
    0,
    0.5,
    0.002,
    0.0012,
    0.003,
    0.08,
)
OVEN = Plant(
    "Oven",
    _text(
        "Oven",
        "W",
        '  parameter Real C(unit="J/K") = 500.0;\n  parameter Real G(unit="W/K") = 2.0;\n'
        '  output Real T(unit="K", start=20, fixed=true);\nequation\n  C*der(T) = u - G*T;\n',
        "T",
    ),
    ("u", "W"),
    ("T", "K"),
    lambda u, y, f: [(u - 2.0 * y[0] + f) / 500.0],
    (20.0,),
    ("T",),
    0,
    3.0,
    120.0,
    60.0,
    0.0005,
    0.01,
)
COIL = Plant(
    "Coil",
    _text(
        "Coil",
        "V",
        '  parameter Real L(unit="H") = 0.05;\n  parameter Real R(unit="Ohm") = 1.5;\n'
        '  output Real i(unit="A", start=0, fixed=true);\nequation\n  L*der(i) = u - R*i;\n',
        "i",
    ),
    ("u", "V"),
    ("i", "A"),
    lambda u, y, f: [(u - 1.5 * y[0] + f) / 0.05],
    (0.0,),
    ("i",),
    0,
    0.002,
    0.0,
    5.0,
    1.0,
    15.0,
)
CAPACITOR = Plant(
    "Capacitor",
    _text(
        "Capacitor",
        "A",
        '  parameter Real C(unit="F") = 0.02;\n  parameter Real g(unit="S") = 0.05;\n'
        '  output Real V(unit="V", start=0, fixed=true);\nequation\n  C*der(V) = u - g*V;\n',
        "V",
    ),
    ("u", "A"),
    ("V", "V"),
    lambda u, y, f: [(u - 0.05 * y[0] + f) / 0.02],
    (0.0,),
    ("V",),
    0,
    0.005,
    0.1,
    0.4,
    0.2,
    5.0,
)
PLANTS: Mapping[str, Plant] = {
    "mass": MASS,
    "pendulum": PENDULUM,
    "rotor": ROTOR,
    "tank": TANK,
    "oven": OVEN,
    "coil": COIL,
    "capacitor": CAPACITOR,
}
