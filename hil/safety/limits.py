"""What a session may do: numbers that only people at the bench set."""

import math
from dataclasses import dataclass, fields, replace

from fmus.errors import MisfitError

# A torque that comes up faster than this is a jump for whoever holds the arm.
MIN_RAMP_S = 0.05


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
        ramp_s: time in which torque comes up when a controller takes over, and goes down when the arm gives way.
        bandwidth: rad/s of the low pass on speeds.
        reduced: share of the torque that is left while something is in doubt; afterwards it comes back along the ramp.
        missing_comply_s, missing_release_s: time without a position after which the arm gives way, and is let go.
        answer_s: age of an answer, from its question on, beyond which it is not believed.
        late_comply_s: time of cycles in a row that began late or took too long.
        stall_s: time beyond a period without a cycle after which the arm is let go; the watchdog and the loop let it go
            after so long without a sign of the other.
        force_missing_s: time without an answer of the force sensor.
        frozen_s: time without a change of position under more than the breakaway torque, or of an unchanged force.
        effect_s: time for which a torque beyond the breakaway has not moved its joint, and no force at the wrist tells why.
        unexplained: rad/s by which a joint may speed up within 0.1 s without a torque or a force that pushes it.
        reach: m, the lever of a force at the wrist on a joint, at most.
        oscillation: changes of sign of a joint's torque in a second, each by more than half its limit.
        disagreement: N.m of a joint that a model of the arm, with what was learned beside it, may leave unexplained for `effect_s`.
        force: N at the wrist; beyond it the arm gives way to whoever pushes.
        warm, hot: degC of a motor from which on there is less torque, and the arm gives way.
        thermal_s: time in which a motor's heat follows its torque.
        pinch_s: time for which a joint may press with all that it may where it can pinch.
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
    missing_comply_s: float = 0.005
    missing_release_s: float = 0.029
    answer_s: float = 0.005
    late_comply_s: float = 0.03
    stall_s: float = 0.025
    force_missing_s: float = 0.05
    frozen_s: float = 0.2
    effect_s: float = 0.15
    unexplained: float = 100.0
    reach: float = 0.8
    oscillation: int = 10
    disagreement: float = 1.5
    force: float = 80.0
    warm: float = 60.0
    hot: float = 75.0
    thermal_s: float = 120.0
    pinch_s: float = 0.2

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
        if not self.missing_comply_s <= self.missing_release_s:
            raise MisfitError(
                f"missing_release_s = {self.missing_release_s:g} s: the arm would be let go before it gives way"
                f" (missing_comply_s = {self.missing_comply_s:g} s)"
            )
        if self.ramp_s < MIN_RAMP_S:
            raise MisfitError(
                f"ramp_s = {self.ramp_s:g} s; {MIN_RAMP_S:g} s or more was expected, so that no torque jumps"
            )


def lowered(limits: Limits, share: float = 0.5) -> Limits:
    """Limits for an arm that lacks a safeguard: a share of the torques, their rates, speeds, power and energy."""
    joints = tuple(
        replace(joint, torque=share * joint.torque, torque_rate=share * joint.torque_rate, speed=share * joint.speed)
        for joint in limits.joints
    )
    return replace(limits, joints=joints, power=share * limits.power, energy=share * limits.energy)


def _positive(name: str, value: float) -> None:
    if not (math.isfinite(value) and value > 0):
        raise MisfitError(f"limit {name} = {value:g}; a positive number was expected")


def _range(name: str, low: float, high: float) -> None:
    if not (math.isfinite(low) and math.isfinite(high) and low < high):
        raise MisfitError(f"{name} is [{low:g}, {high:g}] rad; a finite one was expected")
