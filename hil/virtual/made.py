"""How a virtual robot is made: what its nodes say of themselves, what moves it, and who presses its buttons."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from fmus.errors import MisfitError
from hil.emulation.planar import Placement
from hil.robots import proficio
from hil.robots.known import PROFICIO
from hil.robots.proficio import Controller, Side
from hil.virtual.body import Body
from hil.virtual.loaded import LoadedJoints
from hil.virtual.node import VERSION
from hil.virtual.plant import FreeJoints, Plant
from hil.virtual.robot import RealTime, VirtualRobot
from hil.virtual.safety_module import HEARTBEAT_NS

# Kinds of virtual robots; what a session needs to know of the drives of one that has them.
DRIVES = "cia402"
KINDS = (PROFICIO, DRIVES)
DRIVES_OPTIONS: dict[str, Any] = {"nodes": (1, 2, 3), "gear": (50.0, 50.0, 50.0), "home": (0.0, 0.0, 1.35)}
# N.m of their motors: a thousandth of it at a joint is 0.01 N.m.
RATED = 0.2
# What a property of 16 bits (IPNM) holds, and how many counts a position of 22 bits holds (CTS).
MOST_TORQUE_UNITS, MOST_COUNTS = 32767, 2**21 - 1


@dataclass(frozen=True)
class Made:
    """Settings of a virtual robot.

    `eager` presses Activate once the arm is zeroed; `body` is the arm strapped to it, joints that do not feel each
    other without one. `controllers` are those of the motors; `heartbeat_s` is after how long without a word to the
    motors an active arm is let go, `version` the firmware of the motors; `kind` "cia402" is a robot of three CiA 402
    drives, of which only the body counts. A Proficio's own values of these are nowhere published.
    """

    side: Side = "right"
    eager: bool = True
    body: Body | None = None
    controllers: tuple[Controller, ...] = (Controller(),) * proficio.JOINTS
    heartbeat_s: float = HEARTBEAT_NS * 1e-9
    version: int = VERSION
    kind: str = PROFICIO

    def made(self) -> RealTime:
        """The robot of that kind, at home.

        Raises:
            MisfitError: if there is no such model of an arm.
        """
        if self.kind != DRIVES:
            return self.robot()
        from hil.virtual.drives import VirtualDrive, VirtualDrives

        drives = [VirtualDrive(node, rated=RATED) for node in DRIVES_OPTIONS["nodes"]]
        return VirtualDrives(self._plant(np.array(DRIVES_OPTIONS["home"])), drives, DRIVES_OPTIONS["gear"])

    def robot(self) -> VirtualRobot:
        """A Proficio, at home.

        Raises:
            MisfitError: if there is no such model of an arm.
        """
        heartbeat_ns = round(self.heartbeat_s * 1e9)
        return VirtualRobot(
            self._plant(proficio.HOME[self.side]),
            self.controllers,
            eager=self.eager,
            heartbeat_ns=heartbeat_ns,
            version=self.version,
        )

    def _plant(self, home: np.ndarray) -> Plant:
        if self.body is None:
            return FreeJoints(home)
        if self.body.burden is not None:
            return LoadedJoints(home, self.body.burden)
        from hil.virtual.arm_plant import ArmPlant

        return ArmPlant(home, Placement(self.side, self.body.shoulder), self.body.model, self.body.values)


def controllers(counts: str, torque_units: str) -> tuple[Controller, ...]:
    """Those of the motors, from counts a turn and torque units per N.m: a number for all, or one each, with commas between.

    Raises:
        MisfitError: if that is not what was written.
    """
    by_motor = zip(
        _by_motor("--counts", counts, MOST_COUNTS),
        _by_motor("--torque-units", torque_units, MOST_TORQUE_UNITS),
        strict=True,
    )
    return tuple(Controller(each, units) for each, units in by_motor)


def _by_motor(option: str, text: str, most: int) -> list[int]:
    words = text.split(",")
    numbers = [int(word) for word in words if word.strip().isdecimal() and word.isascii() and 1 <= int(word) <= most]
    if len(numbers) != len(words) or len(words) not in (1, proficio.JOINTS):
        raise MisfitError(
            f"{option} {text}: a whole number from 1 to {most} was expected, or {proficio.JOINTS} of them as in 4096,4096,4096"
        )
    return numbers * (proficio.JOINTS // len(numbers))
