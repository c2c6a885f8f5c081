"""A motor of a virtual robot with its controller."""

import math

from hil.codecs.barrett.identifiers import Address, Group, answer_of
from hil.codecs.barrett.positions import HIGHEST, LOWEST, pack_positions
from hil.codecs.barrett.tables import ABSOLUTE_ENCODER, Kind
from hil.codecs.barrett.torques import unpack_torques
from hil.codecs.frame import Frame, Timed
from hil.errors import FrameError
from hil.robots.proficio import Controller
from hil.virtual.node import ANSWER_NS, VERSION, Node

IDLE, TORQUE = 0, 2
# degC, V of the supply, and poles: 6 is what the vendor's library knows of an arm's motors (those of gimbals have 8).
AMBIENT, SUPPLY, POLES = 30, 48, 6
# Properties that say which groups of nodes a motor belongs to.
GROUPS = ("GRPA", "GRPB", "GRPC")


class Motor(Node):
    """Motor 1 to 7; `angle` rad is that of its rotor, which a plant turns."""

    def __init__(self, number: int, controller: Controller, version: int = VERSION) -> None:
        upper = number > 4
        torques = Group.UPPER_TORQUES if upper else Group.LOWER_TORQUES
        super().__init__(number, Kind.MOTOR, (), version)
        # Whether the safety module lets motors have torque; without one nobody but the host decides.
        self.is_allowed = True
        self.controller, self.torque_group = controller, torques
        self.angle = 0.0
        # What the counts were shifted by when the arm was zeroed.
        self.offset = 0
        self.values |= {
            "ROLE": ABSOLUTE_ENCODER,
            "CTS": controller.counts,
            "IPNM": int(controller.torque_units),
            "PIDX": (number - 1) % 4,
            "GRPA": Group.ALL,
            "GRPB": torques,
            "GRPC": Group.ARM,
            "MODE": IDLE,
            "TEMP": AMBIENT,
            "VBUS": SUPPLY,
            "POLES": POLES,
        }
        self.stored = dict(self.values)

    @property
    def counts(self) -> int:
        """What the encoder says, wrapped to 22 bits."""
        turned = math.floor(self.angle * self.controller.counts / (2 * math.pi)) + self.offset
        return (turned - LOWEST) % (HIGHEST - LOWEST + 1) + LOWEST

    def belongs_to(self, group: int) -> bool:
        """Whether one of its three properties of groups names that one, as a host may have set them."""
        return any(self.values[name] == group for name in GROUPS)

    @property
    def torque(self) -> float:
        """Torque in N.m that the motor makes; none while it is idle or asleep."""
        if not (self.powered and self.is_awake and self.values["MODE"] == TORQUE):
            return 0.0
        return self.values["T"] / self.controller.torque_units

    def command(self, address: Address, data: bytes) -> None:
        """Take its torque out of a torque frame; nothing happens if the frame is not for it."""
        if not (self.is_awake and self.powered and address.to_group and address.receiver == self.torque_group):
            return
        try:
            torques = unpack_torques(data, self.numbers["T"])
        except FrameError:
            return
        self.values["T"] = torques[self.values["PIDX"] % 4]

    def _asked(self, number: int, time_ns: int) -> list[Timed]:
        if self.is_awake and number == self.numbers["P"]:
            frame = Frame(answer_of(self.number, Group.POSITIONS), pack_positions(self.counts))
            return [Timed(time_ns + ANSWER_NS * self.number, frame)]
        return super()._asked(number, time_ns)

    def _read(self, name: str, time_ns: int) -> int:
        if name == "MECH":  # the rotor's own angle within a turn, which zeroing does not move
            return math.floor(self.angle * self.controller.counts / (2 * math.pi)) % self.controller.counts
        return super()._read(name, time_ns)

    def _set(self, name: str, value: int, time_ns: int) -> None:
        if name == "P":
            self.offset += value - self.counts
        elif name == "MODE" and value == IDLE:
            self.values |= {"MODE": IDLE, "T": 0}
        elif name == "MODE" and not self.is_allowed:
            return
        else:
            super()._set(name, value, time_ns)
