"""What a controller can do besides asking for torques; a session looks whether it has these names."""

from typing import NamedTuple, Protocol, runtime_checkable


class Shown(NamedTuple):
    """A signal that a controller shows beside its torque."""

    name: str
    unit: str
    description: str


@runtime_checkable
class Showing(Protocol):
    """A controller that shows what it knows: `signals` are what, `shown` their values in the last cycle."""

    signals: tuple[Shown, ...]
    shown: tuple[float, ...]


@runtime_checkable
class Modelling(Protocol):
    """A controller that knows the arm: `unmodelled` N.m of each joint are what it cannot explain of the last motion,
    None if it cannot tell."""

    unmodelled: tuple[float, ...] | None


@runtime_checkable
class Pausing(Protocol):
    """A controller that pauses: `turn` counts how often it has begun to ask, and each time its torque comes up along the ramp."""

    turn: int


@runtime_checkable
class Ending(Protocol):
    """A controller that knows when it is done."""

    @property
    def is_done(self) -> bool:
        """Whether the session may end."""
        ...
