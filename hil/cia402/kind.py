"""Robots of CiA 402 drives behind the contract of robots: `kind = "cia402"` in `[robot]` of a bench file."""

import math
from collections.abc import Callable, Mapping, Sequence
from typing import Any

from fmus.errors import MisfitError
from hil.cia402 import objects
from hil.cia402.frames import (
    FAULTS,
    LAST_NODE,
    NETWORK,
    OFF,
    command_of,
    emergency_of,
    is_hosts,
    pack_command,
    state_of,
    status_of,
)
from hil.cia402.network import Drive, WireNetwork
from hil.cia402.robot import DrivesRobot
from hil.codecs.frame import Frame
from hil.errors import BusError
from hil.robots.base import Gains, Line, Sleep
from hil.robots.defaults import limits_of
from hil.safety.limits import JointLimits, Limits

# Another host with a cycle of 10 Hz or more is heard within this time; a drive changes its state within so long.
COMPANY_S, SETTLE_S = 0.15, 0.02
# Nothing is known of what hangs on the drives: these move little, and are to be set in the bench file.
_TORQUE, _RATE, _SPEED, _RANGE, _UNEXPLAINED = 2.0, 200.0, 1.0, 1.0, 0.5
# Less than what is left of the torque without a safety module, which drives do not have.
_BREAKAWAY = 0.4 * _TORQUE
# Commands of the network's master.
_OPERATIONAL, _PRE_OPERATIONAL = 0x01, 0x80
# ms without a command after which a drive switches itself off.
_WATCHDOG_MS = 100
# Bit of an identifier that switches its process data off.
_PDO_OFF = 1 << 31


class Drives:
    """Joints with a CiA 402 drive each, in cyclic synchronous torque mode.

    Args:
        nodes: their numbers on the bus, in the order of joints.
        gear: motor turns in a joint's turn, negative where they turn against each other; 1 without it.
        home: rad of each joint where it is zeroed.
        absolute: encoders keep their place without power; `offset` are their counts at home. Otherwise the operator is asked.
        without_drive_watchdog: go on with drives that cannot switch themselves off when commands stay away.

    Raises:
        MisfitError: if numbers do not fit each other.
    """

    name = "CiA 402 drives"

    def __init__(
        self,
        nodes: Sequence[int] = (1, 2),
        gear: Sequence[float] | None = None,
        home: Sequence[float] | None = None,
        absolute: bool = False,
        offset: Sequence[int] | None = None,
        without_drive_watchdog: bool = False,
    ) -> None:
        self.nodes = tuple(nodes)
        self.joints = len(self.nodes)
        self.gear = tuple(map(float, gear if gear is not None else [1.0] * self.joints))
        self.home = tuple(map(float, home if home is not None else [0.0] * self.joints))
        self.offset = tuple(offset if offset is not None else [0] * self.joints)
        self.absolute, self.without_drive_watchdog = absolute, without_drive_watchdog
        for key, switch in (("absolute", absolute), ("without_drive_watchdog", without_drive_watchdog)):
            if not isinstance(switch, bool):
                raise MisfitError(f"{key} = {switch!r}; true or false was expected")
        if (
            not self.nodes
            or any(isinstance(node, bool) or not isinstance(node, int) for node in self.nodes)
            or any(not 1 <= node <= LAST_NODE for node in self.nodes)
            or len(set(self.nodes)) < self.joints
        ):
            raise MisfitError(f"nodes = {list(nodes)}; different numbers from 1 to {LAST_NODE} were expected")
        if {len(self.gear), len(self.home), len(self.offset)} != {self.joints} or 0.0 in self.gear:
            raise MisfitError(f"gear, home and offset need {self.joints} numbers each, as many as nodes; no gear is 0")
        if not all(map(math.isfinite, (*self.gear, *self.home))):
            raise MisfitError(f"gear = {list(self.gear)}, home = {list(self.home)}; finite numbers were expected")
        self.frame = f"robot: CiA 402 drives {', '.join(map(str, self.nodes))}, a joint each"

    @property
    def torque_identifiers(self) -> frozenset[int]:
        """Commands."""
        return frozenset(map(command_of, self.nodes))

    @property
    def heard(self) -> tuple[tuple[int, int], ...]:
        """Status, emergencies, and others' commands."""
        numbers = [of(node) for node in self.nodes for of in (status_of, emergency_of, command_of)]
        return tuple((number, 0x7FF) for number in numbers)

    def limits(self, rate_hz: float) -> Limits:
        """Little, as nothing is known of what hangs on the drives."""
        joints = tuple(
            JointLimits(_TORQUE, _RATE, _SPEED, home - _RANGE, home + _RANGE, breakaway=_BREAKAWAY)
            for home in self.home
        )
        return limits_of(joints, rate_hz, _UNEXPLAINED)

    def gains(self) -> Gains:
        """A soft posture."""
        count = self.joints
        return Gains((4.0,) * count, (0.4,) * count, (0.5 * _TORQUE,) * count)

    def company(self, line: Line) -> Frame | None:
        """A frame of another host."""
        deadline = line.now() + int(COMPANY_S * 1e9)
        while (left := (deadline - line.now()) * 1e-9) > 0:
            timed = line.receive(left)
            if timed is not None and is_hosts(timed.frame.identifier):
                return timed.frame
        return None

    def enumerate(self, line: Line) -> list[str]:
        """Each drive with its state."""
        network, found = WireNetwork(line), []
        for node in self.nodes:
            drive = Drive(network, node)
            try:
                state = state_of(drive.read(objects.STATUSWORD))
                found.append(f"drive {node}: profile {drive.read(objects.DEVICE_TYPE) & 0xFFFF}, {state}")
            except BusError as error:
                found.append(str(error))
        return found

    def missing(self, line: Line) -> str:
        """A drive that does not answer."""
        network = WireNetwork(line)
        try:
            for node in self.nodes:
                Drive(network, node).read(objects.STATUSWORD)
        except BusError as error:
            return str(error)
        return ""

    def stop(self) -> list[Frame]:
        """No torque, and power stages off."""
        return [pack_command(node, OFF) for node in self.nodes]

    def restore(self, document: Mapping[str, Any]) -> DrivesRobot:
        """The robot of a recording."""
        return DrivesRobot(**{name: tuple(values) for name, values in document.items()})

    def start_up(self, line: Line, sleep: Sleep, at_home: Callable[[], bool]) -> DrivesRobot:
        """Set all drives up without torque, and zero the joints."""
        if (heard := self.company(line)) is not None:
            raise MisfitError(f"{line.name}: another program talks to these drives ({heard}); end its session first")
        network = WireNetwork(line)
        drives = [Drive(network, node) for node in self.nodes]
        for drive in drives:
            self._manage(line, drive, _PRE_OPERATIONAL)
            self._check(drive)
            self._set_up(drive)
        for drive in drives:
            self._manage(line, drive, _OPERATIONAL)
        sleep(SETTLE_S)
        offset = self.offset
        if not self.absolute:
            if not at_home():
                raise MisfitError("the joints are not where they are zeroed; move them there and start again")
            offset = tuple(drive.read(objects.POSITION) for drive in drives)
        turns = [(drive.read(objects.ENCODER, 1), drive.read(objects.ENCODER, 2)) for drive in drives]
        rated = tuple(1e-3 * drive.read(objects.RATED_TORQUE) for drive in drives)  # in mN.m
        if min(map(min, turns)) <= 0 or min(rated) <= 0:
            raise MisfitError(
                f"{line.name}: drives say {turns} counts in turns and {rated} N.m; positive numbers were expected"
            )
        counts = tuple(increments / revolutions for increments, revolutions in turns)
        most = tuple(drive.read(objects.MOST_TORQUE) for drive in drives)
        return DrivesRobot(self.nodes, counts, rated, most, self.gear, offset, self.home)

    def _manage(self, line: Line, drive: Drive, command: int) -> None:
        line.send(Frame(NETWORK, bytes([command, drive.number])))

    def _check(self, drive: Drive) -> None:
        """Refuse what is no drive for torques."""
        if (profile := drive.read(objects.DEVICE_TYPE) & 0xFFFF) != objects.PROFILE:
            raise MisfitError(
                f"node {drive.number} has the device profile {profile}; a drive, {objects.PROFILE}, was expected"
            )
        if not drive.read(objects.SUPPORTED_MODES) & objects.CYCLIC_TORQUE_BIT:
            raise MisfitError(
                f"drive {drive.number} does not support the cyclic synchronous torque mode (object 0x6502)"
            )
        state = state_of(drive.read(objects.STATUSWORD))
        if state in FAULTS:
            error = drive.read(objects.ERROR_CODE)
            raise MisfitError(
                f"drive {drive.number} is in the state {state}, error {error:#06x}; remove its cause and reset it"
            )

    def _set_up(self, drive: Drive) -> None:
        """Power stage off, mode, what a command and a status hold, and that it switches itself off without commands."""
        drive.write(objects.CONTROLWORD, OFF)
        drive.write(objects.TORQUE, 0)
        drive.write(objects.MODE, objects.CYCLIC_TORQUE)
        if (mode := drive.read(objects.MODE_SHOWN)) != objects.CYCLIC_TORQUE:
            raise MisfitError(f"drive {drive.number} stays in mode {mode}; {objects.CYCLIC_TORQUE} was asked for")
        at_once, with_sync = 255, 1
        commanded = ((objects.CONTROLWORD, 16), (objects.TORQUE, 16))
        said = ((objects.STATUSWORD, 16), (objects.POSITION, 32), (objects.TORQUE_SHOWN, 16))
        self._map(drive, 0x1400, command_of(drive.number), at_once, commanded)
        self._map(drive, 0x1800, status_of(drive.number), with_sync, said)
        try:
            drive.write(0x1400, _WATCHDOG_MS, objects.EVENT_TIMER)
            drive.write(objects.ABORT_CONNECTION, objects.DISABLE_VOLTAGE)
        except BusError as error:
            if not self.without_drive_watchdog:
                raise MisfitError(
                    f"{error}: it would go on with its last torque if commands stay away; to run it all the same say"
                    " without_drive_watchdog = true in [robot]"
                ) from error

    def _map(self, drive: Drive, talk: int, identifier: int, when: int, entries: Sequence[tuple[int, int]]) -> None:
        """Say what a process data object holds; it is switched off meanwhile."""
        drive.write(talk, identifier | _PDO_OFF, 1)
        drive.write(talk, when, 2)
        mapping = talk + 0x200
        drive.write(mapping, 0, 0)
        for place, (index, bits) in enumerate(entries, start=1):
            drive.write(mapping, index << 16 | bits, place)
        drive.write(mapping, len(entries), 0)
        drive.write(talk, identifier, 1)
