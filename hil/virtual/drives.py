"""Virtual CiA 402 drives: nodes of the `canopen` library whose motors move a plant. Like `VirtualRobot` they have no clock."""

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
from canopen import LocalNode, Network

from hil.cia402 import objects
from hil.cia402.frames import EMERGENCY_HEAT, EMERGENCY_WATCHDOG, OFF, PERMILLE, SYNC, emergency_of, state_of, status_of
from hil.cia402.objects import object_dictionary
from hil.codecs.frame import Frame, Timed
from hil.virtual.plant import Plant, encoder_angles
from hil.virtual.robot import LONGEST_STEP_S, MOST_BEHIND_S, RealTime

# Answers are on the bus after so long, one after the other.
ANSWER_NS = 75_000
# Statusword of each state, and the states that a controlword leads to from it, by (mask, bits) of the word.
_WORDS = {
    "SWITCH ON DISABLED": 0x40,
    "READY TO SWITCH ON": 0x21,
    "SWITCHED ON": 0x23,
    "OPERATION ENABLED": 0x27,
    "FAULT": 0x08,
}
_SHUTDOWN, _SWITCH_ON, _ENABLE = (0x87, 0x06), (0x8F, 0x07), (0x8F, 0x0F)
_STEPS = {
    "SWITCH ON DISABLED": ((_SHUTDOWN, "READY TO SWITCH ON"),),
    "READY TO SWITCH ON": ((_SWITCH_ON, "SWITCHED ON"), (_ENABLE, "SWITCHED ON")),
    "SWITCHED ON": ((_ENABLE, "OPERATION ENABLED"), (_SHUTDOWN, "READY TO SWITCH ON")),
    "OPERATION ENABLED": ((_SHUTDOWN, "READY TO SWITCH ON"), (_SWITCH_ON, "SWITCHED ON")),
}


class VirtualDrive:
    """One drive; `angle` rad is that of its motor, which a plant turns.

    Args:
        counts: of the motor's turn; `rated` N.m of it; `bias` counts that the encoder shows at angle 0.
    """

    def __init__(self, number: int, counts: int = 4096, rated: float = 1.0, bias: int = 1234) -> None:
        self.number, self.counts, self.rated, self.bias = number, counts, rated, bias
        self.angle, self.powered, self.state = 0.0, True, "SWITCH ON DISABLED"
        self.sent: list[Frame] = []
        self._network = _Caught(self.sent)
        self._commanded_ns = 0
        self.node: Any = LocalNode(number, object_dictionary())
        self._network.add_node(self.node)
        self._values = {
            (objects.DEVICE_TYPE, 0): objects.PROFILE, (objects.SUPPORTED_MODES, 0): objects.CYCLIC_TORQUE_BIT,
            (objects.RATED_TORQUE, 0): round(1e3 * rated), (objects.MOST_TORQUE, 0): 3000,
            (objects.ENCODER, 1): counts, (objects.ENCODER, 2): 1, (objects.ERROR_CODE, 0): 0,
            (objects.MODE, 0): 0, (objects.TORQUE, 0): 0, (objects.CONTROLWORD, 0): OFF,
            (0x1400, objects.EVENT_TIMER): 0, (objects.ABORT_CONNECTION, 0): 0,
        }  # fmt: skip
        for place, value in self._values.items():
            self._store(*place, value)
        self.node.add_write_callback(  # type: ignore[no-untyped-call]  # the library has no complete types
            lambda index, subindex, od, data: self._written(index, data)
        )
        self._show()

    def value(self, index: int, subindex: int = 0) -> int:
        """The value of an object, 0 if nobody has set it."""
        data = self.node.data_store.get(index, {}).get(subindex, b"")
        return int(self._variable(index, subindex).decode_raw(data)) if data else 0

    @property
    def torque(self) -> float:
        """Torque in N.m that the motor makes."""
        if not self.powered or self.state != "OPERATION ENABLED" or self.value(objects.MODE) != objects.CYCLIC_TORQUE:
            return 0.0
        most = self.value(objects.MOST_TORQUE)
        return min(max(self.value(objects.TORQUE), -most), most) / PERMILLE * self.rated

    @property
    def position(self) -> int:
        """What the encoder says, wrapped to 32 bits."""
        turned = math.floor(self.angle * self.counts / (2 * math.pi)) + self.bias
        return (turned + 2**31) % 2**32 - 2**31

    def receive(self, frame: Frame, time_ns: int) -> list[Timed]:
        """Take a frame; returns the answers."""
        self.sent.clear()
        if not self.powered:
            return []
        works = self.node.nmt.state == "OPERATIONAL"
        if works and frame.identifier == self.value(0x1400, 1):
            self._commanded_ns = time_ns
            self._take(frame.data)
        elif works and frame.identifier == SYNC and self.value(0x1800, 2) == 1:
            self.sent.append(Frame(self.value(0x1800, 1), self._said()))
        else:
            self._network.notify(frame.identifier, bytearray(frame.data), time_ns * 1e-9)
        return [Timed(time_ns + ANSWER_NS * self.number, sent) for sent in self.sent]

    def watch(self, time_ns: int) -> list[Timed]:
        """Go off if commands have stayed away for too long."""
        most_ns = 1_000_000 * self.value(0x1400, objects.EVENT_TIMER)
        if not (most_ns and self.state == "OPERATION ENABLED" and time_ns - self._commanded_ns > most_ns):
            return []
        return self.fail(EMERGENCY_WATCHDOG, time_ns)

    def fail(self, error: int, time_ns: int) -> list[Timed]:
        """A fault: the power stage is off, and everybody hears why."""
        self.state = "FAULT"
        self._store(objects.ERROR_CODE, 0, error)
        self._show()
        return [Timed(time_ns, Frame(emergency_of(self.number), error.to_bytes(2, "little") + bytes(6)))]

    def _take(self, data: bytes) -> None:
        """Process data: what the mapping says they hold."""
        at = 0
        for index, subindex, size in self._mapped(0x1600):
            self._store_bytes(index, subindex, data[at : at + size])
            at += size
            if index == objects.CONTROLWORD:
                self._command()

    def _said(self) -> bytes:
        self._show()
        return b"".join(self.node.data_store[index][subindex] for index, subindex, _ in self._mapped(0x1A00))

    def _mapped(self, mapping: int) -> list[tuple[int, int, int]]:
        """Index, subindex and bytes of each entry."""
        entries = [self.value(mapping, place) for place in range(1, self.value(mapping, 0) + 1)]
        return [(entry >> 16, entry >> 8 & 0xFF, (entry & 0xFF) // 8) for entry in entries]

    def _written(self, index: int, data: bytes) -> None:
        if index == objects.CONTROLWORD:
            self._store_bytes(index, 0, data)
            self._command()
        elif index == objects.MODE:
            self._store_bytes(objects.MODE_SHOWN, 0, data)

    def _command(self) -> None:
        """One step of the state machine."""
        word = self.value(objects.CONTROLWORD)
        if self.state == "FAULT":
            return  # who resets it stands beside it
        if not word & 0x02:
            self.state = "SWITCH ON DISABLED"
        for (mask, bits), state in _STEPS[self.state]:
            if word & mask == bits:
                self.state = state
                break
        self._show()

    def _show(self) -> None:
        self._store(objects.STATUSWORD, 0, _WORDS[self.state])
        assert state_of(_WORDS[self.state]) == self.state
        self._store(objects.POSITION, 0, self.position)
        self._store(objects.TORQUE_SHOWN, 0, round(PERMILLE * self.torque / self.rated))

    def _variable(self, index: int, subindex: int) -> Any:
        found = self.node.object_dictionary[index]
        return found[subindex] if hasattr(found, "subindices") else found

    def _store(self, index: int, subindex: int, value: int) -> None:
        self._store_bytes(index, subindex, self._variable(index, subindex).encode_raw(value))

    def _store_bytes(self, index: int, subindex: int, data: bytes) -> None:
        self.node.data_store.setdefault(index, {})[subindex] = bytes(data)


class VirtualDrives(RealTime):
    """Drives on a bus that move a plant with as many joints.

    Args:
        gear: motor turns in a joint's turn.
    """

    def __init__(self, plant: Plant, drives: Sequence[VirtualDrive], gear: Sequence[float]) -> None:
        self.plant, self.drives, self.gear = plant, tuple(drives), np.array(gear, dtype=float)
        self.time_ns: int | None = None
        self.nodes = self.drives
        self.positions, self.position = frozenset(status_of(drive.number) for drive in self.drives), (2, 6, 4)
        self._said: list[Timed] = []
        self._turn()

    def receive(self, frame: Frame, time_ns: int) -> list[Timed]:
        """Take a frame from the bus; returns what is answered, in the order of time."""
        if time_ns > (self.time_ns or 0):
            self.advance(time_ns)
        answers, self._said = self._said, []
        for drive in self.drives:
            answers += drive.receive(frame, time_ns)
        return sorted(answers, key=lambda timed: timed.time_ns)

    def advance(self, time_ns: int) -> None:
        """Let the plant move until a time."""
        if self.time_ns is None:
            self.time_ns = time_ns
        left = min((time_ns - self.time_ns) * 1e-9, MOST_BEHIND_S)
        while left > 1e-12:
            step = min(left, LONGEST_STEP_S)
            self.plant.step(self.gear * [drive.torque for drive in self.drives], step)
            left -= step
        self.time_ns = max(self.time_ns, time_ns)
        self._turn()
        for drive in self.drives:
            self._said += drive.watch(time_ns)

    def fail(self, number: int, time_ns: int) -> bool:
        """A drive gets too hot; whether there is one of that number."""
        failing = [drive for drive in self.drives if drive.number == number]
        for drive in failing:
            self._said += drive.fail(EMERGENCY_HEAT, time_ns)
        return bool(failing)

    def _turn(self) -> None:
        angles = encoder_angles(self.plant)
        for drive, angle in zip(self.drives, (self.gear * angles).tolist(), strict=True):
            drive.angle = angle


class _Caught(Network):  # type: ignore[misc]  # the library has no complete types
    """A network that keeps what a node sends."""

    def __init__(self, sent: list[Frame]) -> None:
        super().__init__()
        self._sent = sent

    def send_message(self, can_id: int, data: bytes, remote: bool = False) -> None:
        self._sent.append(Frame(can_id, bytes(data)))
