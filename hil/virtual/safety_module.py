"""The safety module of a virtual robot, with its pendant."""

from collections.abc import Sequence

from hil.codecs.barrett.identifiers import Node as Place
from hil.codecs.barrett.safety_module import Button, Level, Mode, Pendant, encode_pendant
from hil.codecs.barrett.tables import Kind
from hil.virtual.motor import GROUPS, IDLE, TORQUE, Motor
from hil.virtual.node import Node

# Patterns of the display: "0", "A" and "E".
_DISPLAY = {Mode.IDLE: 0x3F, Mode.ACTIVE: 0x77, Mode.ESTOP: 0x79}

HEARTBEAT_NS = 200_000_000
# N.m of a motor that are warned of, and at which the arm is let go (TL1, TL2).
TORQUES = (4731 / 2700, 5204 / 2700)


class SafetyModule(Node):
    """Watches torques, speeds and the traffic; switches the motors' modes.

    Args:
        eager: whether somebody presses Activate once the arm is zeroed and the host speaks to the motors.
        heartbeat_ns: time without requests or torques to the motors after which an active arm is a fault. The real one's
            is not published.
    """

    def __init__(self, motors: Sequence[Motor], *, eager: bool = False, heartbeat_ns: int = HEARTBEAT_NS) -> None:
        super().__init__(Place.SAFETY, Kind.SAFETY, ())
        self.motors, self.eager, self.heartbeat_ns = motors, eager, heartbeat_ns
        # It compares units of all motors with one limit: that of the motor with the coarsest ones.
        units = min(motor.controller.torque_units for motor in motors)
        warned, most = (round(torque * units) for torque in TORQUES)
        self.values |= {"MODE": Mode.IDLE, "VL1": 2048, "VL2": 4096, "TL1": warned, "TL2": most, "STAT": 2}
        self.stored = dict(self.values)
        for motor in motors:
            motor.is_allowed = False
        self.button = Button.NONE
        self.levels = dict.fromkeys(("other", "heartbeat", "voltage", "torque", "velocity"), Level.SAFE)
        self._heard_ns = 0

    @property
    def mode(self) -> Mode:
        """The mode of the whole arm."""
        return Mode(self.values["MODE"])

    def press(self, button: Button, time_ns: int) -> None:
        """Press a button of the pendant (with shift, where shift is needed)."""
        self.button = button
        if button is Button.ESTOP:
            self._switch(Mode.ESTOP)
        elif button is Button.IDLE:
            if self.mode is Mode.ESTOP:
                self._restart()
            self._switch(Mode.IDLE)
        elif button is Button.ACTIVATE and self.mode is Mode.IDLE:
            self.levels = dict.fromkeys(self.levels, Level.SAFE)
            self._heard_ns = time_ns
            self._switch(Mode.ACTIVE)

    def hear_host(self, time_ns: int) -> None:
        """Note that the host speaks to the motors."""
        self._heard_ns = time_ns
        if self.eager and self.mode is Mode.IDLE and self.values["ZERO"] == 1:
            self.eager = False
            self.press(Button.ACTIVATE, time_ns)

    def hear_torques(self, torques: Sequence[int]) -> None:
        """Check a torque frame that passes on the bus."""
        self._judge("torque", max(map(abs, torques), default=0), self.values["TL1"], self.values["TL2"])

    def watch(self, speed: float, time_ns: int) -> None:
        """Check the fastest point of the arm, in m/s, and that the host is alive."""
        if self.mode is not Mode.ACTIVE:
            return
        self._judge("velocity", int(speed * 4096), self.values["VL1"], self.values["VL2"])
        if time_ns - self._heard_ns > self.heartbeat_ns:
            self._fault("heartbeat")

    def _judge(self, name: str, value: int, warning: int, limit: int) -> None:
        if limit and value > limit:
            self._fault(name)
        elif self.levels[name] is not Level.FAULT:
            self.levels[name] = Level.WARNING if value > warning else Level.SAFE

    def _fault(self, name: str) -> None:
        if self.mode is Mode.ACTIVE:
            self.levels[name] = Level.FAULT
            self._switch(Mode.IDLE)

    def _switch(self, mode: Mode) -> None:
        self.values["MODE"] = mode
        for motor in self.motors:
            motor.values["T"] = 0
            motor.is_allowed = mode is Mode.ACTIVE
            motor.values["MODE"] = TORQUE if mode is Mode.ACTIVE else IDLE
            motor.powered = mode is not Mode.ESTOP

    def _restart(self) -> None:
        """Power comes back: motors sleep and have lost their counts."""
        self.values["ZERO"] = 0
        for motor in self.motors:
            motor.values |= {"STAT": 0, **{name: motor.stored[name] for name in GROUPS}}
            motor.offset = 0

    def _read(self, name: str, time_ns: int) -> int:
        if name == "PEN":
            lights = (self.mode is Mode.ACTIVE, self.mode is Mode.IDLE)
            return encode_pendant(Pendant._make((self.button, *lights, _DISPLAY[self.mode], *self.levels.values())))
        return super()._read(name, time_ns)

    def _set(self, name: str, value: int, time_ns: int) -> None:
        if name == "MODE":
            if value in (Mode.ESTOP, Mode.IDLE) and value < self.mode:  # only the pendant leads upwards
                self._switch(Mode(value))
        else:
            super()._set(name, value, time_ns)
