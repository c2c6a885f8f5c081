"""Joints that are turned by CiA 402 drives, once they have said what they are. See `hil.robots.base.Robot`."""

import math
from collections.abc import Collection, Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from hil.cia402.frames import ENABLE, PERMILLE, SYNC, command_of, status_of, unpack_command
from hil.cia402.link import DrivesLink
from hil.codecs.frame import Frame
from hil.robots.absent import MODULE, SENSOR
from hil.robots.base import Line, Link
from hil.safety.cycle import Vector
from hil.safety.limits import Limits


@dataclass(frozen=True)
class DrivesRobot:
    """Drives by node, a joint each.

    Args:
        nodes: numbers on the bus, in the order of joints.
        counts: of a motor's turn.
        rated: N.m of each motor, of which torques are thousandths; `most` thousandths that the drive allows.
        gear: motor turns in a joint's turn, negative where they turn against each other.
        offset: counts where a joint is at `home` rad.
    """

    nodes: tuple[int, ...]
    counts: tuple[float, ...]
    rated: tuple[float, ...]
    most: tuple[int, ...]
    gear: tuple[float, ...]
    offset: tuple[int, ...]
    home: tuple[float, ...]

    @property
    def about(self) -> str:
        """What an operator is asked about."""
        return f"robot with CiA 402 drives {', '.join(map(str, self.nodes))}"

    @property
    def steps(self) -> np.ndarray:
        """Resolution (n,) rad of the joints' angles."""
        return np.abs(2 * math.pi / (np.array(self.counts) * np.array(self.gear)))

    @property
    def lacks(self) -> tuple[str, ...]:
        """Drives alone have neither a safety module with a pendant nor a sensor of forces."""
        return MODULE, SENSOR

    def joint_angles(self, counts: np.ndarray) -> np.ndarray:
        """Joint angles (n,) in rad from counts (n,)."""
        turned = (counts - np.array(self.offset)) * (2 * math.pi / np.array(self.counts))
        return np.asarray(np.array(self.home) + turned / np.array(self.gear))

    def permille(self, torques: np.ndarray) -> np.ndarray:
        """Thousandths of the rated torques, towards zero, that make joint torques (n,) in N.m: power is the same on
        both sides."""
        return np.trunc(PERMILLE * torques / (np.array(self.gear) * np.array(self.rated)))

    def link(self, limits: Limits, waived: Collection[str], force_axes: np.ndarray) -> Link:
        """The frames of a new session."""
        return DrivesLink(self, limits, waived)

    def question(self) -> tuple[list[Frame], frozenset[int]]:
        """A SYNC, and the identifiers of the answers."""
        return [Frame(SYNC, b"")], frozenset(map(status_of, self.nodes))

    def holding_torques(self, angles: Vector) -> Vector:
        """None: what hangs on the drives is not known here, so a robot with a weight needs `gravity = false` and a
        brake or balance."""
        return (0.0,) * len(self.nodes)

    def looser_limits(self, line: Line, limits: Limits) -> list[str]:
        """Joints whose torque needs more than their drive allows."""
        wanted = np.abs(self.permille(np.array([joint.torque for joint in limits.joints])))
        return [
            f"joint {k} needs {permille:.0f} thousandths of the rated torque of drive {node}, which allows {most};"
            " lower `torque` of [[joints]]"
            for k, (node, permille, most) in enumerate(zip(self.nodes, wanted, self.most, strict=True), start=1)
            if permille > most
        ]

    def commanded(self, frames: Sequence[Frame]) -> np.ndarray | None:
        """Joint torques (n,) in N.m of the drives' commands; of drives that are not told to be in operation none."""
        said = {frame.identifier: unpack_command(frame) for frame in frames}
        found = [said.get(command_of(node)) for node in self.nodes]
        if all(each is None for each in found):
            return None
        permille = [each[1] if each is not None and each[0] == ENABLE else 0 for each in found]
        return np.asarray(np.array(permille) / PERMILLE * np.array(self.rated) * np.array(self.gear))

    def to_json(self) -> dict[str, Any]:
        """All of it, for a recording."""
        return asdict(self)
