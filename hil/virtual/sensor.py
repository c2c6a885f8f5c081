"""The force/torque sensor of a virtual robot."""

import numpy as np

from hil.codecs.barrett.force_torque import DIVISORS, Status, pack_reading
from hil.codecs.barrett.identifiers import Group, answer_of
from hil.codecs.barrett.identifiers import Node as Place
from hil.codecs.barrett.tables import Kind
from hil.codecs.frame import Frame, Timed
from hil.virtual.node import ANSWER_NS, Node

# N that it can say.
_MOST = 32767 / DIVISORS[Group.FORCE]


class ForceSensor(Node):
    """Says the force that a plant feels at its wrist, with noise, its own zero error and its limits."""

    def __init__(self, noise: float = 0.3, seed: int = 1) -> None:
        super().__init__(Place.FORCE_SENSOR, Kind.FORCE_SENSOR, (Group.ALL,))
        self.force = np.zeros(3)
        self.zero = np.array([1.5, -0.7, 0.4])
        self.tare = np.zeros(3)
        self.noise = noise
        self._random = np.random.default_rng(seed)

    def _asked(self, number: int, time_ns: int) -> list[Timed]:
        if not (self.is_awake and number in (self.numbers["FT"], self.numbers["A"])):
            return super()._asked(number, time_ns)
        if number == self.numbers["A"]:
            data = pack_reading(Group.ACCELERATION, (0.0, 0.0, -9.80665))
            return [Timed(time_ns + ANSWER_NS, Frame(answer_of(self.number, Group.ACCELERATION), data))]
        raw = (self.force + self.zero - self.tare + self.noise * self._random.standard_normal(3)).tolist()
        status = Status(False, False, (0,)) if max(map(abs, raw)) > _MOST else None
        force = pack_reading(Group.FORCE, [min(max(part, -_MOST), _MOST) for part in raw], status)
        torque = pack_reading(Group.TORQUE, (0.0, 0.0, 0.0), status)
        return [
            Timed(time_ns + ANSWER_NS, Frame(answer_of(self.number, Group.FORCE), force)),
            Timed(time_ns + 2 * ANSWER_NS, Frame(answer_of(self.number, Group.TORQUE), torque)),
        ]

    def _set(self, name: str, value: int, time_ns: int) -> None:
        if name == "FT":
            self.tare = self.force + self.zero
        else:
            super()._set(name, value, time_ns)
