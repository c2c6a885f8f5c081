"""How a virtual robot is made: what its nodes say of themselves, what moves it, and who presses its buttons."""

from collections import deque
from dataclasses import dataclass
from typing import Any

import numpy as np

from fmus.errors import MisfitError
from hil.emulation.planar import Placement
from hil.robots import proficio
from hil.robots.known import PROFICIO
from hil.robots.proficio import Controller, Side
from hil.virtual.body import Body, Burden
from hil.virtual.node import VERSION
from hil.virtual.plant import FreeJoints, Plant
from hil.virtual.robot import RealTime, VirtualRobot
from hil.virtual.safety_module import HEARTBEAT_NS

# m from the axes of a Proficio's joints to its end with a straight elbow: a payload there is seen by each joint as
# inertia m r^2.
REACH = np.array([1.085, 1.085, 0.435])
# Below this speed (rad/s) dry friction grows with speed instead of jumping.
STICKING = 1e-3


class LoadedJoints(FreeJoints):
    """Joints that do not feel each other, with a burden; the weight of the payload is held by whoever lifts the arm, joint 1.

    Args:
        angles: (n,) rad at the beginning.
        inertia: kg.m2 of each joint without payload.
        seed: of the noise.
    """

    def __init__(self, angles: np.ndarray, burden: Burden, inertia: float = 0.05, seed: int = 3) -> None:
        super().__init__(angles, inertia, burden.friction)
        reach = np.resize(REACH, len(self.angles))
        self.inertia = inertia + burden.payload * reach**2
        self.burden = burden
        self._time = 0.0
        # Torques with the times from which they act, the first of them now.
        self._coming: deque[tuple[float, np.ndarray]] = deque([(0.0, np.zeros(len(self.angles)))])
        self._random = np.random.default_rng(seed)

    def step(self, torques: np.ndarray, seconds: float) -> None:
        """Move on by a time; the torques act after the delay, and those from before until then."""
        if not np.array_equal(torques, self._coming[-1][1]):
            self._coming.append((self._time + self.burden.delay, np.array(torques, dtype=float)))
        end = self._time + seconds
        while self._time < end:
            until = min(self._coming[1][0], end) if len(self._coming) > 1 else end
            if until > self._time:
                self._under(self._coming[0][1], until - self._time)
            self._time = until
            if len(self._coming) > 1 and self._coming[1][0] <= self._time:
                self._coming.popleft()

    def shown(self) -> np.ndarray:
        """Angles (n,) in rad as the encoders show them."""
        return self.angles + self.burden.noise * self._random.standard_normal(len(self.angles))

    def _under(self, torques: np.ndarray, seconds: float) -> None:
        """Move on by a time under those torques and dry friction, which opposes the motion, or the torque where a joint
        stands."""
        dry = self.burden.dry
        if dry:
            driven = torques + self.outside
            stands = np.abs(self.speeds) < STICKING
            held = np.where(stands, np.clip(driven, -dry, dry), dry * np.sign(self.speeds))
            torques = torques - held
        before = self.speeds
        super().step(torques, seconds)
        if dry:  # friction brings a joint to rest and not beyond
            self.speeds = np.where(before * self.speeds < 0, 0.0, self.speeds)


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
