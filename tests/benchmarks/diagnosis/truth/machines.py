"""The machines of the benchmark: data, signals, time scale, sensors."""

from collections.abc import Mapping
from dataclasses import dataclass, field


@dataclass(frozen=True)
class Machine:
    """A machine as the benchmark measures it; `name` is that of the built-in model under test.

    `values` are its nominal numbers, by the simulator's names. `outputs` and `inputs` map columns to units, in the
    order of the simulator. `tolerances` maps a simulator's name to the model's parameter that it stands for: those
    that a manufacturing tolerance may move. `torque` is a size of torque that is small for this machine; `seconds` of
    a trial are stretched by `slow`. `commands` are inputs that are known exactly, as they are computed.
    """

    name: str
    values: Mapping[str, float]
    inputs: Mapping[str, str]
    outputs: Mapping[str, str]
    tolerances: Mapping[str, str]
    torque: float = 0.0
    slow: float = 1.0
    step: float = 1e-3
    rate_hz: float = 250.0
    commands: frozenset[str] = frozenset()
    order: tuple[int, ...] = field(default=(0, 1))  # simulator's coordinates in the order of `outputs`

    @property
    def joints(self) -> int:
        """Number of joints that can hold a joint torque."""
        return 0 if self.name == "tanks" else 1 if self.name in ("pendulum", "drive", "cart") else 2


_POLE = {"m": 0.147585, "a": 0.147755, "I": 1.0912e-4}
_ARM_LINKS = {"l1": 0.33, "l2": 0.32, "m1": 1.93, "m2": 1.52, "cm1": 0.165, "cm2": 0.19, "I1": 0.0141, "I2": 0.0188}
_BARS = {"l1": 0.25, "l2": 0.25, "m1": 0.20, "m2": 0.15, "cm1": 0.125, "cm2": 0.125, "I1": 1.1e-3, "I2": 0.8e-3}
_LINK_NAMES = {
    f"{own}{k}": f"linkage.{model}[{k}]" for own, model in (("m", "m"), ("cm", "c"), ("I", "I")) for k in (1, 2)
}
ALPHAS = tuple(f"alpha_{k}" for k in range(1, 7))

MACHINES = {
    machine.name: machine
    for machine in (
        Machine(
            "arm",
            {**_ARM_LINKS, "nb1": 0.30, "nb2": 0.30},
            {**dict.fromkeys(ALPHAS, "1"), "fx": "N", "fy": "N"},
            {"q1": "rad", "q2": "rad"},
            {**_LINK_NAMES, "nb1": "linkage.b[1]", "nb2": "linkage.b[2]"},
            torque=0.1,
            commands=frozenset(ALPHAS),
        ),
        Machine(
            "pendulum",
            {**_POLE, "g": 9.81001},
            {},
            {"theta": "rad"},
            {"m": "m", "a": "a", "I": "I"},
            torque=1e-3,
            order=(0,),
        ),
        Machine("drive", {"J": 0.02}, {"torque": "N.m"}, {"phi": "rad"}, {"J": "J"}, torque=0.01, order=(0,)),
        Machine(
            "two-mass",
            {"JMotor": 0.002, "JLoad": 0.005, "k": 20.0, "d": 0.01},
            {"torque": "N.m"},
            {"phiMotor": "rad", "phiLoad": "rad"},
            {"JMotor": "JMotor", "JLoad": "JLoad", "k": "k", "d": "d"},
            torque=5e-3,
        ),
        Machine(
            "cart",
            {**_POLE, "g": 9.81, "M": 0.5},
            {"force": "N"},
            {"x": "m", "theta": "rad"},
            {"M": "M", "m": "m", "a": "l", "I": "I"},
            torque=1e-3,
            order=(1, 0),
        ),
        Machine(
            "double-pendulum",
            {**_BARS, "gy": -9.81},
            {},
            {"q1": "rad", "q2": "rad"},
            _LINK_NAMES,
            torque=5e-3,
        ),
        Machine(
            "tanks",
            {"A1": 0.015, "A2": 0.015, "a1": 5e-5, "a2": 5e-5, "g": 9.81},
            {"inflow": "m3/s"},
            {"h1": "m", "h2": "m"},
            {"A1": "A1", "A2": "A2", "a1": "a1", "a2": "a2"},
            slow=60.0,
            step=0.25,
            rate_hz=1.0,
        ),
    )
}
