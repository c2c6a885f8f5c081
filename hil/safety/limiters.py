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
    kept = []
    for k, joint in enumerate(limits.joints):
        speed, t = motion.speeds[k], wanted[k]
        kept.append(0.0 if abs(speed) > joint.speed and t * speed > 0 else t)
    return tuple(kept)


def inwards_only(limits: Limits, motion: Motion, last: Vector, wanted: Vector) -> Vector:
    """A joint beyond its range gets no torque that pushes it further."""
    kept = []
    for k, joint in enumerate(limits.joints):
        position, t = motion.positions[k], wanted[k]
        outwards = (position > joint.high and t > 0) or (position < joint.low and t < 0)
        kept.append(0.0 if outwards else t)
    return tuple(kept)


def power(limits: Limits, motion: Motion, last: Vector, wanted: Vector) -> Vector:
    """Each joint may give an equal share of the power, so that one that moves costs another no strength to hold."""
    share = limits.power / len(limits.joints)
    kept = []
    for k, speed in enumerate(motion.speeds):
        t = wanted[k]
        kept.append(share / speed if t * speed > share else t)
    return tuple(kept)


def torque(limits: Limits, motion: Motion, last: Vector, wanted: Vector) -> Vector:
    """No joint gets more than its torque."""
    return tuple([min(max(wanted[k], -joint.torque), joint.torque) for k, joint in enumerate(limits.joints)])


def unpinching(limits: Limits, motion: Motion, last: Vector, wanted: Vector) -> Vector:
    """Where a joint can pinch it gets less."""
    kept = []
    for k, joint in enumerate(limits.joints):
        most = pinch_torque(joint, motion.positions[k])
        kept.append(min(max(wanted[k], -most), most))
    return tuple(kept)


def pinch_torque(joint: JointLimits, position: float) -> float:
    """Torque in N.m that a joint may have at an angle in rad; the smallest of its zones there, infinite outside of them."""
    most = math.inf
    for zone in joint.zones:
        if zone.low <= position <= zone.high:
            most = min(most, zone.torque)
    return most


def torque_rate(limits: Limits, motion: Motion, last: Vector, wanted: Vector) -> Vector:
    """No torque grows faster than its rate; towards zero it may go at once.

    The time that counts is that of a period: after a gap a torque must not jump.
    """
    kept = []
    for k, joint in enumerate(limits.joints):
        most = joint.torque_rate * limits.period_ns * 1e-9
        # Between zero and the last torque every value is allowed.
        low, high = min(last[k], 0.0) - most, max(last[k], 0.0) + most
        kept.append(min(max(wanted[k], low), high))
    return tuple(kept)


LIMITERS: tuple[Limiter, ...] = (torque, unpinching, braking_only, inwards_only, power, torque_rate)
