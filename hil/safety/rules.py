"""What must not happen: each rule looks at one hazard and says what should become of the torque."""

import math
from collections.abc import Callable
from typing import Final

from hil.record import is_finite
from hil.safety.cycle import Module, Motion, Reaction, Seen, State, Trip, Vector
from hil.safety.limits import Limits

Rule = Callable[[Limits, State, Motion, Seen], Trip | None]

SECOND_NS: Final = 1_000_000_000
# A cycle is late if so many periods have passed since the last one.
LATE_PERIODS: Final = 1.5
# A controller that takes this share of a period is late as well.
SLOW_SHARE: Final = 0.5
# Late cycles in a row leave less torque after this share of the time after which the arm gives way.
LATE_REDUCE: Final = 0.2
# Positions that keep missing now and then count as missing after this times the time for those in a row.
UNSURE: Final = 2.0
# No joint stops from so many rad/s to the last digit of its encoder at once, and stays there for this share of the time
# after which an encoder that stands still counts as frozen.
HALTED: Final = 0.3
HALTED_SHARE: Final = 0.1
# An encoder has jumped if so many answers in a row are too far away; one may have been garbled on its way.
JUMPS: Final = 2
# Share of the heat that a motor bears from which on there is less torque.
WARM_SHARE: Final = 0.8
# Beyond this times its limit of speed a joint is damped and no more, and beyond the second it is let go.
GIVES_WAY: Final = 1.25
LET_GO: Final = 2.0


def in_ms(time_ns: int) -> str:
    """A time in milliseconds, to three digits but never as a power of ten."""
    return f"{time_ns * 1e-6:.3g}" if abs(time_ns) < 999_500_000 else f"{time_ns * 1e-6:.0f}"


def is_late(limits: Limits, state: State, seen: Seen) -> bool:
    """Tell whether a cycle began late, or its controller took too long."""
    passed = seen.time_ns - state.time_ns
    return passed > LATE_PERIODS * limits.period_ns or seen.computing_ns > SLOW_SHARE * limits.period_ns


def finite_command(limits: Limits, state: State, motion: Motion, seen: Seen) -> Trip | None:
    """A controller that asks for what is no number has failed."""
    for words, values in (("asked for", seen.asked), ("needed to hold the weight", seen.support)):
        for k, value in enumerate(values):
            if not is_finite(value):
                reaction = Reaction.SUPPORT if words == "asked for" else Reaction.RELEASE
                return Trip("finite_command", reaction, f"torque {words} at joint {k + 1} is {value} N.m")
    if len(seen.asked) != len(limits.joints) or len(seen.support) != len(limits.joints):
        words = f"{len(seen.asked)} and {len(seen.support)} torques for {len(limits.joints)} joints"
        return Trip("finite_command", Reaction.RELEASE, words)
    return None


def _size(vector: Vector) -> float:
    total = 0.0
    for part in vector:
        total += part * part
    return math.sqrt(total)


def pushing(limits: Limits, seen: Seen) -> float:
    """Torque in N.m that the force at the wrist can make at a joint, at most."""
    return limits.reach * _size(seen.force) if seen.force is not None else 0.0


def positions_answered(limits: Limits, state: State, motion: Motion, seen: Seen) -> Trip | None:
    """Joints whose position does not come, or cannot be believed, are steered blindly."""
    unknown = motion.unknown
    worst, unsure = max(unknown), max(state.unsure)
    if unsure > UNSURE * limits.missing_comply_s * SECOND_NS:
        joint = state.unsure.index(unsure) + 1
        words = f"positions of joint {joint} come too late or not at all again and again ({in_ms(unsure)} ms lately)"
        if worst < limits.missing_release_s * SECOND_NS:
            is_lost = unsure >= limits.missing_release_s * SECOND_NS
            return Trip("positions_answered", Reaction.RELEASE if is_lost else Reaction.COMPLY, words)
    if not worst:
        return None
    reaction = Reaction.REDUCE
    if worst >= limits.missing_release_s * SECOND_NS:
        reaction = Reaction.RELEASE
    elif worst >= limits.missing_comply_s * SECOND_NS:
        reaction = Reaction.COMPLY
    joint = unknown.index(worst)
    words = f"no believable position of joint {joint + 1} for {in_ms(worst)} ms"
    if motion.missing[joint] < worst:
        words = f"positions of joint {joint + 1} come too late or not at all: none is certain for {in_ms(worst)} ms"
    return Trip("positions_answered", reaction, words)


def encoder_steady(limits: Limits, state: State, motion: Motion, seen: Seen) -> Trip | None:
    """An encoder that says again that the joint is where it cannot have gone has jumped."""
    for k, jumps in enumerate(motion.jumps):
        if jumps >= JUMPS:
            words = f"the encoder of joint {k + 1} jumped by {motion.jumped[k]:.3g} rad"
            return Trip("encoder_steady", Reaction.COMPLY, words)
    return None


def encoder_alive(limits: Limits, state: State, motion: Motion, seen: Seen) -> Trip | None:
    """An encoder is frozen that stops at once, or says exactly the same under a torque that moves the joint for certain."""
    for k, joint in enumerate(limits.joints):
        if (
            motion.halted
            and motion.halted[k] > HALTED
            and motion.still[k] >= HALTED_SHARE * limits.frozen_s * SECOND_NS
        ):
            words = (
                f"the encoder of joint {k + 1} has said exactly the same for {in_ms(motion.still[k])} ms, right after"
                f" {motion.halted[k]:.2g} rad/s"
            )
            return Trip("encoder_alive", Reaction.COMPLY, words)
        # Who holds the joint against its torque is seen at the wrist.
        pushed = abs(state.active[k]) - pushing(limits, seen) > joint.breakaway
        if pushed and motion.still[k] >= limits.frozen_s * SECOND_NS:
            words = f"joint {k + 1} stands still to the last digit under {state.active[k]:.3g} N.m for {in_ms(motion.still[k])} ms"
            return Trip("encoder_alive", Reaction.COMPLY, words)
    return None


def torque_acts(limits: Limits, state: State, motion: Motion, seen: Seen) -> Trip | None:
    """A torque that should move a joint and does not is lost on its way, or presses against what nobody sees."""
    worst = max(state.pressed)
    if worst < limits.effect_s * SECOND_NS:
        return None
    k = state.pressed.index(worst)
    words = (
        f"joint {k + 1} has not followed {state.active[k]:.3g} N.m for {in_ms(worst)} ms, and no force at the wrist holds"
        " it: torques do not reach it, or it is blocked"
    )
    # The motors are switched to idle as well: a torque of zero may be lost on its way like those before it.
    return Trip("torque_acts", Reaction.RELEASE, words)


def motion_explained(limits: Limits, state: State, motion: Motion, seen: Seen) -> Trip | None:
    """A joint that speeds up though nothing known pushes it is driven by what nobody commands."""
    for k, speed in enumerate(motion.speeds):
        gained = abs(speed) - state.calm_speed[k]
        if gained > limits.unexplained:
            words = (
                f"joint {k + 1} sped up by {gained:.3g} rad/s, and neither its torque nor a force at the wrist"
                " pushes it that way"
            )
            return Trip("motion_explained", Reaction.RELEASE, words)
    return None


def on_time(limits: Limits, state: State, motion: Motion, seen: Seen) -> Trip | None:
    """A loop that stands still, or whose clock jumps, knows neither speeds nor what its last torque has done."""
    passed = seen.time_ns - state.time_ns
    period = limits.period_ns
    if passed <= 0:
        return Trip("on_time", Reaction.SUPPORT, f"the clock moved by {in_ms(passed)} ms between two cycles")
    if passed > period + limits.stall_s * SECOND_NS:
        words = f"the session stood still: {in_ms(passed)} ms between two cycles of {in_ms(period)} ms"
        return Trip("on_time", Reaction.RELEASE, words)
    if not is_late(limits, state, seen):
        return None
    late = state.late + passed
    words = f"for {in_ms(late)} ms all cycles were late or took more than half of {in_ms(period)} ms"
    if late >= limits.late_comply_s * SECOND_NS:
        return Trip("on_time", Reaction.COMPLY, words)
    if late >= LATE_REDUCE * limits.late_comply_s * SECOND_NS:
        return Trip("on_time", Reaction.REDUCE, words)
    return None


def speed_limited(limits: Limits, state: State, motion: Motion, seen: Seen) -> Trip | None:
    """An arm that is thrown, or runs away, is not driven."""
    for k, joint in enumerate(limits.joints):
        speed = motion.speeds[k]
        if abs(speed) > GIVES_WAY * joint.speed:
            reaction = Reaction.RELEASE if abs(speed) > LET_GO * joint.speed else Reaction.COMPLY
            words = f"joint {k + 1} moves at {speed:.3g} rad/s, its limit is {joint.speed:g} rad/s"
            return Trip("speed_limited", reaction, words)
    return None


def inside_range(limits: Limits, state: State, motion: Motion, seen: Seen) -> Trip | None:
    """Beyond the range of motion are end stops, or the limits of a patient's arm."""
    for k, joint in enumerate(limits.joints):
        position = motion.positions[k]
        beyond = max(joint.low - position, position - joint.high)
        if beyond > joint.margin:
            words = f"joint {k + 1} is at {position:.4g} rad, outside [{joint.low:g}, {joint.high:g}] rad"
            return Trip("inside_range", Reaction.COMPLY, words)
    return None


def energy_bounded(limits: Limits, state: State, motion: Motion, seen: Seen) -> Trip | None:
    """Energy that the arm keeps giving away goes into whoever holds it."""
    if state.energy > limits.energy:
        words = f"the arm gave whoever holds it {state.energy:.3g} J more than it got back, the limit is {limits.energy:g} J"
        return Trip("energy_bounded", Reaction.COMPLY, words)
    return None


def force_bounded(limits: Limits, state: State, motion: Motion, seen: Seen) -> Trip | None:
    """A person who pushes hard wins; a sensor that saturates, or repeats itself to the last digit, cannot tell."""
    if not seen.sensor:
        return Trip("force_bounded", Reaction.RELEASE, "there is no force sensor, or it has not answered yet")
    if seen.force is None:
        return None
    if seen.force_missing_ns > limits.force_missing_s * SECOND_NS:
        words = f"the force sensor has not answered for {in_ms(seen.force_missing_ns)} ms"
        return Trip("force_bounded", Reaction.COMPLY, words)
    size = _size(seen.force)
    if not size <= limits.force:
        return Trip("force_bounded", Reaction.COMPLY, f"{size:.3g} N at the wrist, the limit is {limits.force:g} N")
    if seen.force_saturated:
        return Trip("force_bounded", Reaction.COMPLY, "the force sensor is beyond its range")
    if state.force_still >= limits.frozen_s * SECOND_NS:
        words = f"the force sensor has said exactly the same for {in_ms(state.force_still)} ms"
        return Trip("force_bounded", Reaction.COMPLY, words)
    return None


def cool(limits: Limits, state: State, motion: Motion, seen: Seen) -> Trip | None:
    """A motor that overheats fails, and burns who touches it; its heat is estimated where it does not tell."""
    heat, warm = max(state.heat), False
    for temperature in seen.temperatures:
        if temperature is None:
            continue
        if not temperature < limits.hot:
            words = f"a motor is at {temperature:g} degC, the limit is {limits.hot:g} degC"
            return Trip("cool", Reaction.COMPLY, words)
        warm |= temperature >= limits.warm
    if heat > 1.0:
        joint = state.heat.index(heat) + 1
        words = (
            f"joint {joint} has made more torque than the {limits.joints[joint - 1].continuous:g} N.m its motor bears"
        )
        return Trip("cool", Reaction.COMPLY, words)
    if warm or heat > WARM_SHARE:
        return Trip("cool", Reaction.REDUCE, "a motor is getting hot")
    return None


def unpinched(limits: Limits, state: State, motion: Motion, seen: Seen) -> Trip | None:
    """A joint that presses with all that it may and does not move, where it can pinch, has something in between."""
    worst = max(state.pinched)
    if worst < limits.pinch_s * SECOND_NS:
        return None
    joint = state.pinched.index(worst) + 1
    words = f"joint {joint} has pressed without moving for {in_ms(worst)} ms where it can pinch"
    return Trip("unpinched", Reaction.COMPLY, words)


def model_explains(limits: Limits, state: State, motion: Motion, seen: Seen) -> Trip | None:
    """A model that no longer explains how the arm moves shows what is too small for `torque_acts` and `encoder_alive`."""
    worst = max(state.disagreed)
    if worst < limits.effect_s * SECOND_NS:
        return None
    words = (
        f"for {in_ms(worst)} ms joint {state.disagreed.index(worst) + 1} has moved as if more than"
        f" {limits.disagreement:g} N.m acted on it that neither the model nor what was learned explains: torques do not reach"
        " it, its encoder is wrong, or somebody holds it where no sensor is"
    )
    return Trip("model_explains", Reaction.COMPLY, words)


def calm(limits: Limits, state: State, motion: Motion, seen: Seen) -> Trip | None:
    """A torque that changes its sign again and again is a loop that oscillates against whoever holds the arm."""
    for k, flips in enumerate(state.flips):
        if len(flips) > limits.oscillation:
            words = f"the torque of joint {k + 1} changed its sign {len(flips)} times in a second"
            return Trip("calm", Reaction.COMPLY, words)
    return None


def module_agrees(limits: Limits, state: State, motion: Motion, seen: Seen) -> Trip | None:
    """The robot's own safety module, and the pendant on it, have the last word."""
    if seen.module is None:
        return Trip("module_agrees", Reaction.RELEASE, "the safety module does not answer")
    if seen.module is Module.ABSENT:
        return Trip("module_agrees", Reaction.RELEASE, "there is no safety module")
    if seen.module is Module.ESTOP:
        return Trip("module_agrees", Reaction.SILENCE, "emergency stop")
    if seen.fault:
        return Trip("module_agrees", Reaction.RELEASE, f"the safety module found a limit passed: {seen.fault}")
    if seen.module is Module.IDLE and state.armed_ns is not None:
        words = "the safety module is idle" + (f", after it warned of {seen.warning}" if seen.warning else "")
        return Trip("module_agrees", Reaction.RELEASE, words)
    if seen.warning:
        return Trip("module_agrees", Reaction.REDUCE, f"the safety module warns of {seen.warning}")
    return None


def drives_ready(limits: Limits, state: State, motion: Motion, seen: Seen) -> Trip | None:
    """A drive that has left its operation does not do what the others count on."""
    return Trip("drives_ready", Reaction.RELEASE, seen.trouble) if seen.trouble else None


def alone_on_the_bus(limits: Limits, state: State, motion: Motion, seen: Seen) -> Trip | None:
    """Two hosts that command one arm fight each other; after the watchdog's reaction its own frames are on the bus."""
    if seen.foreign_torque and seen.watched:
        return Trip("alone_on_the_bus", Reaction.RELEASE, "somebody else commands torques on this bus")
    return None


def watched(limits: Limits, state: State, motion: Motion, seen: Seen) -> Trip | None:
    """What the watchdog has let go is not taken up again, and nothing is held that nobody watches."""
    if seen.watched:
        return None
    words = "the watchdog has fallen silent" if seen.watchdog_silent else "the watchdog has let the arm go, or is gone"
    return Trip("watched", Reaction.RELEASE, words)


def recorded(limits: Limits, state: State, motion: Motion, seen: Seen) -> Trip | None:
    """A session that is not recorded is over, but not in a hurry."""
    if not seen.recording:
        return Trip("recorded", Reaction.COMPLY, "frames can no longer be recorded")
    return None


def not_aborted(limits: Limits, state: State, motion: Motion, seen: Seen) -> Trip | None:
    """The operator wants to stop."""
    if seen.abort:
        return Trip("not_aborted", Reaction.COMPLY, "stopped by the operator")
    return None


def not_ended(limits: Limits, state: State, motion: Motion, seen: Seen) -> Trip | None:
    """Nobody commands the arm after a session."""
    return Trip("not_ended", Reaction.RELEASE, "the session has ended") if seen.end else None


# Of those that ask for the same the first one says why: a session that stood still has no positions because of that.
RULES: tuple[Rule, ...] = (
    finite_command,
    on_time,
    positions_answered,
    encoder_steady,
    encoder_alive,
    torque_acts,
    motion_explained,
    speed_limited,
    inside_range,
    energy_bounded,
    force_bounded,
    cool,
    unpinched,
    model_explains,
    calm,
    module_agrees,
    drives_ready,
    alone_on_the_bus,
    watched,
    recorded,
    not_aborted,
    not_ended,
)
