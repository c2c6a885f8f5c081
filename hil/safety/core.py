"""One cycle of the safety core: which torques may be sent, and why not others.

Loops count joints, and tuples are made of lists: compiled that is several times as fast as `zip` and generators.
"""

import math
from typing import Final

from hil.record import is_finite, replaced
from hil.safety.cycle import Module, Motion, Outcome, Reaction, Seen, State, Trip, Vector
from hil.safety.limiters import LIMITERS, Limiter, pinch_torque
from hil.safety.limits import Limits
from hil.safety.motion import at_rest, follow
from hil.safety.rules import RULES, SECOND_NS, Rule, is_late, pushing

# A joint presses with all that it may from this share of its torque on, and rests below this speed in rad/s.
PRESSING: Final = 0.99
RESTING: Final = 0.02
# rad/s by which a torque that acts has changed a joint's speed.
EFFECT: Final = 0.1
# N.m of a torque, and of what a force may make, that push nothing along: the latter is noise of the sensor.
SLACK: Final = 0.05
FORCE_SLACK: Final = 0.5
# Share of the unexplained speed that a joint may gain in a second without being noticed.
DRIFT: Final = 10.0
# A position that comes makes up for a missing one after so many cycles.
FORGET: Final = 4
_MAY_BE_ARMED = (Module.ACTIVE, Module.WAIVED)


def begin(limits: Limits, time_ns: int, positions: Vector) -> State:
    """The state before the first cycle: not armed, at rest.

    Args:
        limits: of the arm and its cycle.
        time_ns: time of the clock, in ns.
        positions: of the joints, in rad.
    """
    count = len(limits.joints)
    zeros = (0.0,) * count
    return State(
        time_ns,
        at_rest(positions),
        torques=zeros,
        active=zeros,
        asked=zeros,
        flips=((),) * count,
        swing=zeros,
        heat=zeros,
        pinched=(0,) * count,
        pressed=(0,) * count,
        pressed_speed=zeros,
        pressed_from=positions,
        unsure=(0,) * count,
        calm_speed=zeros,
        disagreed=(0,) * count,
    )


def step(
    limits: Limits,
    state: State,
    seen: Seen,
    *,
    rules: tuple[Rule, ...] = RULES,
    limiters: tuple[Limiter, ...] = LIMITERS,
    motion: Motion | None = None,
) -> tuple[State, Outcome]:
    """Decide what a cycle may send.

    A pure function: the same limits, state and cycle always give the same outcome. Torques are within their limits
    whatever is asked for; a trip from `COMPLY` on stays until the arm is armed anew.

    Args:
        rules, limiters: all of them; tests leave one out to show that it is needed.
        motion: what `follow` makes of the same three, if that is known already.
    """
    if motion is None:
        motion = follow(limits, state, seen.time_ns, seen.positions, seen.doubted)
    state = _armed(limits, state, motion, seen, rules)
    takes_over = seen.controller != state.controller or state.armed_ns == seen.time_ns
    trips = tuple([trip for rule in rules if (trip := rule(limits, state, motion, seen)) is not None])
    worst = max(trips, key=_reaction) if trips else None
    stopped, reaction = state.stopped, worst.reaction if worst is not None else Reaction.PASS
    if worst is not None and reaction >= Reaction.COMPLY and (stopped is None or reaction > stopped.reaction):
        stopped = worst
    if stopped is not None:
        reaction = max(reaction, stopped.reaction)
    fading = _fading(limits, state, motion, reaction)
    share = 0.0 if takes_over else _share(limits, state, motion, reaction)
    wanted = _wanted(limits, state, motion, seen, reaction, fading * share)
    sent, limited = _limited(limits, limiters, motion, state.torques, wanted)
    if state.armed_ns is None or reaction >= Reaction.RELEASE:
        sent, limited = (0.0,) * len(limits.joints), ()
    after = _remember(limits, state, motion, seen, sent, stopped, reaction, fading, share)
    released = reaction >= Reaction.RELEASE and state.armed_ns is not None
    silent = reaction is Reaction.SILENCE
    return after, Outcome(None if silent else sent, released and not silent, reaction, trips, limited)


def _reaction(trip: Trip) -> Reaction:
    return trip.reaction


def _armed(limits: Limits, state: State, motion: Motion, seen: Seen, rules: tuple[Rule, ...]) -> State:
    """Arm if the operator says so, the module allows it, and nothing is wrong now; all but the motors' heat is forgotten."""
    if not seen.arm or seen.abort or seen.module not in _MAY_BE_ARMED:
        return state
    fresh = begin(limits, state.time_ns, motion.positions)
    fresh = replaced(
        fresh,
        motion=state.motion,
        armed_ns=seen.time_ns,
        late=state.late,
        heat=state.heat,
        unsure=state.unsure,
    )
    if any(rule(limits, fresh, motion, seen) is not None for rule in rules):
        return state
    return fresh


def _fading(limits: Limits, state: State, motion: Motion, reaction: Reaction) -> float:
    """Share of the controller's torque that is left."""
    if reaction < Reaction.COMPLY:
        return state.fading
    if reaction > Reaction.COMPLY:
        return 0.0
    passed = max(motion.seconds, limits.period_ns * 1e-9)
    return max(state.fading - passed / limits.ramp_s, 0.0)


def _share(limits: Limits, state: State, motion: Motion, reaction: Reaction) -> float:
    """Share of the controller's torque that it may have: it comes up along the ramp, is less while something is in doubt, and
    does not grow while the arm gives way."""
    if reaction > Reaction.REDUCE:
        return state.share
    most = limits.reduced if reaction is Reaction.REDUCE else 1.0
    return min(state.share + motion.seconds / limits.ramp_s, most)


def _wanted(limits: Limits, state: State, motion: Motion, seen: Seen, reaction: Reaction, left: float) -> Vector:
    """The torque before it is limited: the arm's weight, and the share that is `left` of the controller's part."""
    support = _support(limits, seen)
    if state.armed_ns is None or reaction >= Reaction.SUPPORT:
        return support
    asked = state.asked if reaction is Reaction.COMPLY else seen.asked
    damping = limits.damping if reaction is Reaction.COMPLY else 0.0
    speeds = motion.speeds
    return tuple([support[k] + left * asked[k] - damping * speeds[k] for k in range(len(speeds))])


def _support(limits: Limits, seen: Seen) -> Vector:
    """The torque that holds the weight, one finite number for each joint whatever was given."""
    given = seen.support
    return tuple([given[k] if k < len(given) and is_finite(given[k]) else 0.0 for k in range(len(limits.joints))])


def _limited(
    limits: Limits, limiters: tuple[Limiter, ...], motion: Motion, last: Vector, wanted: Vector
) -> tuple[Vector, tuple[str, ...]]:
    """Torques after all limiters, and the names of those that cut."""
    cut = []
    for limiter in limiters:
        kept = limiter(limits, motion, last, wanted)
        if kept != wanted:
            cut.append(limiter.__name__)
        wanted = kept
    return wanted, tuple(cut)


def _remember(
    limits: Limits,
    state: State,
    motion: Motion,
    seen: Seen,
    sent: Vector,
    stopped: Trip | None,
    reaction: Reaction,
    fading: float,
    share: float,
) -> State:
    """The state after a cycle."""
    # What was sent last has acted since then; holding the weight is no gift to anybody who lifts the arm.
    given, support, flips, swing = 0.0, _support(limits, seen), list[tuple[int, ...]](), list[float]()
    for k, joint in enumerate(limits.joints):
        given += state.active[k] * motion.speeds[k] * motion.seconds
        before, history, t = state.swing[k], state.flips[k], sent[k]
        large = abs(t) > 0.5 * joint.torque
        if large and t * before < 0:
            history = (*history, seen.time_ns)
        flips.append(tuple([at for at in history if seen.time_ns - at < SECOND_NS]) if history else ())
        swing.append(t if large else before)
    passed_ns = max(seen.time_ns - state.time_ns, 0)
    same = seen.force is not None and seen.force == state.force
    pressed, pressed_speed, pressed_from = _pressed(limits, state, motion, seen, passed_ns)
    return State(
        time_ns=max(seen.time_ns, state.time_ns),
        motion=motion,
        torques=sent,
        active=tuple([sent[k] - support[k] for k in range(len(sent))]),
        # While the arm gives way it follows what was asked before: what is asked now may be what went wrong.
        asked=seen.asked if reaction < Reaction.COMPLY else state.asked,
        armed_ns=state.armed_ns,
        controller=seen.controller,
        stopped=stopped,
        reaction=reaction,
        fading=fading,
        share=share,
        energy=max(state.energy + given - limits.leak * motion.seconds, 0.0),
        late=state.late + passed_ns if is_late(limits, state, seen) else 0,
        force=seen.force,
        force_still=state.force_still + passed_ns if same else 0,
        flips=tuple(flips),
        swing=tuple(swing),
        heat=_heat(limits, state, sent, motion.seconds),
        pinched=_pinched(limits, state, motion, sent, passed_ns),
        pressed=pressed,
        pressed_speed=pressed_speed,
        pressed_from=pressed_from,
        unsure=tuple(
            [
                before + passed_ns if motion.missing[k] else max(before - passed_ns // FORGET, 0)
                for k, before in enumerate(state.unsure)
            ]
        ),
        calm_speed=_calm_speed(limits, state, motion, seen),
        disagreed=_disagreed(limits, state, seen, passed_ns),
    )


def _heat(limits: Limits, state: State, sent: Vector, seconds: float) -> Vector:
    """Heat of each joint after a cycle: dh/dt = ((tau/continuous)^2 - h)/thermal_s, by backward Euler."""
    share = seconds / limits.thermal_s
    heat = []
    for k, joint in enumerate(limits.joints):
        load = sent[k] / joint.continuous
        heat.append((state.heat[k] + share * load * load) / (1.0 + share))
    return tuple(heat)


def _pinched(limits: Limits, state: State, motion: Motion, sent: Vector, passed_ns: int) -> tuple[int, ...]:
    """Time (ns) for which each joint has pressed with all that it may where it can pinch, and has not moved."""
    times = []
    for k, joint in enumerate(limits.joints):
        presses = abs(sent[k]) >= PRESSING * pinch_torque(joint, motion.positions[k])
        times.append(state.pinched[k] + passed_ns if presses and abs(motion.speeds[k]) < RESTING else 0)
    return tuple(times)


def _pressed(
    limits: Limits, state: State, motion: Motion, seen: Seen, passed_ns: int
) -> tuple[tuple[int, ...], Vector, Vector]:
    """How long (ns) a torque that moves each joint for certain has not, and its speed and position when that began.

    It has moved it once it has made it faster, or has brought it so far as it goes at the speed of rest. What the force
    sensor shows may hold a joint back, by its force times the reach at most.
    """
    held = pushing(limits, seen)
    times, speeds, positions = [], [], []
    for k, joint in enumerate(limits.joints):
        torque, speed, position = state.active[k], motion.speeds[k], motion.positions[k]
        way = 1.0 if torque > 0 else -1.0
        begun, start = (state.pressed_speed[k], state.pressed_from[k]) if state.pressed[k] else (speed, position)
        acts = (speed - begun) * way > EFFECT or (position - start) * way > RESTING * limits.effect_s
        goes_on = abs(torque) - held > joint.breakaway and not acts
        times.append(state.pressed[k] + passed_ns if goes_on else 0)
        speeds.append(begun)
        positions.append(start)
    return tuple(times), tuple(speeds), tuple(positions)


def _disagreed(limits: Limits, state: State, seen: Seen, passed_ns: int) -> tuple[int, ...]:
    """Time (ns) for which a model has left more of each joint's torque unexplained than it may; what is no number counts as such."""
    if seen.unmodelled is None:
        return (0,) * len(limits.joints)
    given, times = seen.unmodelled, []
    for k, before in enumerate(state.disagreed):
        torque = given[k] if k < len(given) else math.nan
        times.append(0 if abs(torque) <= limits.disagreement else before + passed_ns)
    return tuple(times)


def _calm_speed(limits: Limits, state: State, motion: Motion, seen: Seen) -> Vector:
    """How fast (rad/s) each joint may be: as when a torque or a force last pushed it along, or less if it has slowed down since.

    It follows a slow drift: that of a weight that is not quite balanced is no drive that runs away.
    """
    pushed = pushing(limits, seen) > FORCE_SLACK
    drift = DRIFT * limits.unexplained * motion.seconds
    calm_speed = []
    for k, speed in enumerate(motion.speeds):
        driven = pushed or state.active[k] * speed > SLACK * abs(speed)
        calm_speed.append(abs(speed) if driven else min(state.calm_speed[k] + drift, abs(speed)))
    return tuple(calm_speed)
