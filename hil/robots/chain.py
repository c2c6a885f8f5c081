"""Where a robot's links are, for pages that draw it: angles and lengths from joint to joint."""

from collections.abc import Sequence
from typing import NamedTuple, Protocol, runtime_checkable

import numpy as np


class Chain(NamedTuple):
    """Links as Denavit and Hartenberg describe them (Spong's convention).

    Attributes:
        links: of each, the angle about x in rad, the length along x and the offset along z, both in m.
        axes: (3, 3), turns the base's axes into the world's, whose z is up.
        base: (3,) in m, where the base is in the world.
    """

    links: Sequence[Sequence[float]]
    axes: Sequence[Sequence[float]]
    base: Sequence[float]

    def places(self, angles: Sequence[float]) -> np.ndarray:
        """Places (2 n + 1, 3) in m at n joint angles in rad: the base, then of each link the end of its offset and its tip."""
        turned, place = np.array(self.axes, dtype=float), np.array(self.base, dtype=float)
        found = [place]
        for angle, (twist, length, offset) in zip(angles, self.links, strict=True):
            c, s, ct, st = np.cos(angle), np.sin(angle), np.cos(twist), np.sin(twist)
            raised = place + offset * turned[:, 2]
            turned = turned @ np.array([[c, -s * ct, s * st], [s, c * ct, -c * st], [0.0, st, ct]])
            place = raised + length * turned[:, 0]
            found += [raised, place]
        return np.array(found)


@runtime_checkable
class Drawn(Protocol):
    """A kind of robot that knows its links; others are not drawn."""

    @property
    def chain(self) -> Chain:
        """Its links."""
        ...
