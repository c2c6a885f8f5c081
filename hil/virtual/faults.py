"""What can go wrong on a bus, or in a node: frames are lost, late, doubled or changed on their way."""

from collections.abc import Callable
from dataclasses import dataclass, field

from hil.codecs.frame import Timed

# A fault takes a frame on its way and says which frames arrive, and when.
Fault = Callable[[Timed], list[Timed]]


@dataclass
class Faults:
    """Faults by direction; each is applied to what the one before it leaves. They may be changed while a robot runs."""

    towards_host: list[Fault] = field(default_factory=list)
    towards_robot: list[Fault] = field(default_factory=list)

    def to_host(self, timed: Timed) -> list[Timed]:
        """What arrives at the host."""
        return _through(self.towards_host, timed)

    def to_robot(self, timed: Timed) -> list[Timed]:
        """What arrives at the robot."""
        return _through(self.towards_robot, timed)


def _through(faults: list[Fault], timed: Timed) -> list[Timed]:
    found = [timed]
    for fault in faults:
        found = [after for before in found for after in fault(before)]
    return found
