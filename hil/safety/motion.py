"""Where the arm is and how fast it moves, as far as its encoders can be believed."""

from typing import Final

from hil.record import is_finite
from hil.safety.cycle import Motion, Positions, State, Vector
from hil.safety.limits import Limits

# No joint is believed to move faster than this times its limit of speed.
FASTEST: Final = 4.0


def follow(limits: Limits, state: State, time_ns: int, found: Positions, doubted: tuple[bool, ...]) -> Motion:
    """Take the positions `found` in a cycle, some of them perhaps `doubted`; one that is missing, or too far from the last,
    leaves the joint where it was.

    Speeds are differences over the measured time, through a first-order low pass (backward Euler):
    w = (w0 + W dt dq/dt)/(1 + W dt), W the bandwidth.

    Args:
        limits: of the arm and its cycle.
        state: after the last cycle.
        time_ns: time of the clock, in ns.
        found: position of each joint in rad, None where it did not come.
        doubted: which of them may be older than the cycle.
    """
    before = state.motion
    # A clock that stood still or went back leaves no time.
    seconds = max(time_ns - state.time_ns, 0) * 1e-9
    passed_ns = max(time_ns - state.time_ns, 1)
    positions, speeds, missing, still, jumps, jumped, halted = [], [], [], [], [], [], []
    for k, joint in enumerate(limits.joints):
        measured = found[k] if k < len(found) else None
        last, speed = before.positions[k], before.speeds[k]
        # A gap allows the more motion the longer it has lasted.
        waited = seconds + before.missing[k] * 1e-9
        reach = FASTEST * joint.speed * max(waited, limits.period_ns * 1e-9)
        if measured is None or not abs(measured - last) <= reach:  # NaN is not believed either
            positions.append(last)
            speeds.append(speed)
            missing.append(before.missing[k] + passed_ns)
            still.append(0)
            halted.append(0.0)
            jump = measured - last if measured is not None and is_finite(measured) else None
            jumps.append(0 if jump is None else before.jumps[k] + 1)
            jumped.append(0.0 if jump is None else jump)
            continue
        filtered = limits.bandwidth * seconds
        rate = (measured - last) / waited if seconds > 0 else 0.0
        positions.append(measured)
        speeds.append((speed + filtered * rate) / (1.0 + filtered))
        missing.append(0)
        still.append(before.still[k] + passed_ns if measured == last else 0)
        begun = before.halted[k] if before.still[k] and before.halted else abs(speed)
        halted.append(begun if measured == last else 0.0)
        jumps.append(0)
        jumped.append(0.0)
    return Motion(
        seconds,
        tuple(positions),
        tuple(speeds),
        tuple(missing),
        tuple(still),
        tuple(jumps),
        tuple(jumped),
        tuple(halted),
        _owed(before, doubted, tuple(missing), passed_ns),
    )


def _owed(before: Motion, doubted: tuple[bool, ...], missing: tuple[int, ...], passed_ns: int) -> tuple[int, ...]:
    """Time (ns) by joint that a doubted position has not made good yet; a certain one does."""
    if not before.owed and not doubted:
        return ()
    owed, found = before.owed or (0,) * len(missing), []
    for k, gap in enumerate(missing):
        is_doubted = k < len(doubted) and doubted[k]
        found.append(owed[k] if gap else owed[k] + before.missing[k] + passed_ns if is_doubted else 0)
    return tuple(found) if any(found) else ()


def at_rest(positions: Vector) -> Motion:
    """The motion with which a session begins."""
    zeros = (0.0,) * len(positions)
    none = (0,) * len(positions)
    return Motion(0.0, positions, zeros, none, none, none, zeros, zeros)
