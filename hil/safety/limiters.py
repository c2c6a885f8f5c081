"""What a torque is cut to, in the order in which it happens; each limiter names itself when it cuts.

After the first all numbers are finite, and each of the others only brings torques nearer to zero, so none undoes another.
"""

import math
from collections.abc import Callable

from hil.safety.cycle import Motion, Vector
from hil.safety.limits import JointLimits, Limits

# limits, motion, the torques sent last, those wanted now -> those left
Limiter = Callable[[Limits, Motion, Vector, Vector], Vector]


def braking_only(limits: Limits, motion: Motion, last: Vector, wanted: Vector) -> Vector:
    """A joint that moves faster than its limit gets no torque along its motion."""
    return tuple(
        0.0 if abs(speed) > joint.speed and torque * speed > 0 else torque
        for joint, speed, torque in zip(limits.joints, motion.speeds, wanted, strict=True)
    )


def inwards_only(limits: Limits, motion: Motion, last: Vector, wanted: Vector) -> Vector:
    """A joint beyond its range gets no torque that pushes it further."""
    kept = []
    for joint, position, torque in zip(limits.joints, motion.positions, wanted, strict=True):
        outwards = (position > joint.high and torque > 0) or (position < joint.low and torque < 0)
        kept.append(0.0 if outwards else torque)
    return tuple(kept)


def power(limits: Limits, motion: Motion, last: Vector, wanted: Vector) -> Vector:
    """Each joint may give an equal share of the power, so that one that moves costs another no strength to hold."""
    share = limits.power / len(limits.joints)
    return tuple(
        share / speed if torque * speed > share else torque for speed, torque in zip(motion.speeds, wanted, strict=True)
    )


def torque(limits: Limits, motion: Motion, last: Vector, wanted: Vector) -> Vector:
    """No joint gets more than its torque."""
    return tuple(min(max(t, -joint.torque), joint.torque) for joint, t in zip(limits.joints, wanted, strict=True))


def unpinching(limits: Limits, motion: Motion, last: Vector, wanted: Vector) -> Vector:
    """Where a joint can pinch it gets less."""
    kept = []
    for joint, position, t in zip(limits.joints, motion.positions, wanted, strict=True):
        most = pinch_torque(joint, position)
        kept.append(min(max(t, -most), most))
    return tuple(kept)


def pinch_torque(joint: JointLimits, position: float) -> float:
    """Torque in N.m that a joint may have at an angle in rad; the smallest of its zones there, infinite outside of them."""
    return min((zone.torque for zone in joint.zones if zone.low <= position <= zone.high), default=math.inf)


def torque_rate(limits: Limits, motion: Motion, last: Vector, wanted: Vector) -> Vector:
    """No torque grows faster than its rate; towards zero it may go at once.

    The time that counts is that of a period: after a gap a torque must not jump.
    """
    kept = []
    for joint, before, t in zip(limits.joints, last, wanted, strict=True):
        most = joint.torque_rate * limits.period_ns * 1e-9
        # Between zero and the last torque every value is allowed.
        low, high = min(before, 0.0) - most, max(before, 0.0) + most
        kept.append(min(max(t, low), high))
    return tuple(kept)


LIMITERS: tuple[Limiter, ...] = (torque, unpinching, braking_only, inwards_only, power, torque_rate)
