"""What a session may do: numbers that only people at the bench set."""

import math
from dataclasses import dataclass, fields

from fmus.errors import MisfitError


@dataclass(frozen=True, slots=True)
class Zone:
    """Angles of a joint, from `low` to `high` rad, in which something can be pinched: it gets `torque` N.m at most.

    A force F at a distance r from the joint's axis is a torque F r.
    """

    low: float
    high: float
    torque: float

    def __post_init__(self) -> None:
        """Refuse a zone that is none."""
        _positive("torque of a zone", self.torque)
        _range("a zone", self.low, self.high)


@dataclass(frozen=True, slots=True)
class JointLimits:
    """Limits of one joint.

    `torque` N.m and `torque_rate` N.m/s bound what is sent; `speed` rad/s is where only braking is left, and half as much
    again where the arm gives way; `low` and `high` rad are the range in which torque may push outwards, `margin` rad beyond
    it the arm gives way. `breakaway` N.m moves the joint for certain, `continuous` N.m its motor bears for ever. In `zones`
    it gets less.
    """

    torque: float
    torque_rate: float
    speed: float
    low: float
    high: float
    margin: float = 0.1
    breakaway: float = math.inf
    continuous: float = math.inf
    zones: tuple[Zone, ...] = ()

    def __post_init__(self) -> None:
        """Refuse limits that limit nothing."""
        for name in ("torque", "torque_rate", "speed", "margin"):
            _positive(name, getattr(self, name))
        _range("the range of a joint", self.low, self.high)
        for name in ("breakaway", "continuous"):
            if not getattr(self, name) > 0:
                raise MisfitError(f"{name} = {getattr(self, name):g} N.m; a positive torque was expected")


@dataclass(frozen=True, slots=True)
class Limits:
    """Limits of a session.

    Args:
        joints: limits of each joint.
        period_ns: time between two cycles.
        power: W that the arm may give to whoever holds it.
        energy: J that it may give beyond what it got back; `leak` W of it are forgiven.
        damping: N.m.s/rad of each joint while the arm gives way.
        ramp_s: time in which torque comes up after arming, and goes down when the arm gives way.
        bandwidth: rad/s of the low pass on speeds.
        reduced: share of the torque that is left while something is in doubt.
        missing_comply, missing_release: cycles without a position after which the arm gives way, and is let go.
        late_comply: cycles in a row that began late or took too long.
        frozen_cycles: cycles without a change of position under more than the breakaway torque, or of an unchanged force.
        oscillation: changes of sign of a joint's torque in a second, each by more than half its limit.
        divergence: rad that a model's prediction may be off.
        force: N at the wrist; beyond it the arm gives way to whoever pushes.
        warm, hot: degC of a motor from which on there is less torque, and the arm gives way.
        thermal_s: time in which a motor's heat follows its torque.
        pinch_cycles: cycles in which a joint may press with all that it may where it can pinch.
    """

    joints: tuple[JointLimits, ...]
    period_ns: int = 2_000_000
    power: float = 10.0
    energy: float = 1.0
    leak: float = 0.2
    damping: float = 0.5
    ramp_s: float = 1.0
    bandwidth: float = 180.0
    reduced: float = 0.5
    missing_comply: int = 3
    missing_release: int = 15
    late_comply: int = 15
    frozen_cycles: int = 100
    oscillation: int = 10
    divergence: float = 0.3
    force: float = 80.0
    warm: float = 60.0
    hot: float = 75.0
    thermal_s: float = 120.0
    pinch_cycles: int = 100

    def __post_init__(self) -> None:
        """Refuse limits that limit nothing."""
        if not self.joints:
            raise MisfitError("limits without joints; one entry for each joint was expected")
        for field in fields(self)[1:]:
            _positive(field.name, getattr(self, field.name))
        if not self.reduced < 1:
            raise MisfitError(f"reduced = {self.reduced:g}; a share below 1 was expected")
        if not self.warm < self.hot:
            raise MisfitError(f"motors are hot from {self.hot:g} degC on, warm from {self.warm:g}; less was expected")
        if not self.missing_comply <= self.missing_release:
            raise MisfitError(
                f"the arm is let go after {self.missing_release} missing positions, before it gives way after"
                f" {self.missing_comply}"
            )


def _positive(name: str, value: float) -> None:
    if not (math.isfinite(value) and value > 0):
        raise MisfitError(f"limit {name} = {value:g}; a positive number was expected")


def _range(name: str, low: float, high: float) -> None:
    if not (math.isfinite(low) and math.isfinite(high) and low < high):
        raise MisfitError(f"{name} is [{low:g}, {high:g}] rad; a finite one was expected")
