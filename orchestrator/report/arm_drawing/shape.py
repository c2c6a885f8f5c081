"""Where the parts of the arm are: joints by forward kinematics, muscles as strings at the distance of their moment arms.

The model knows of a muscle only its constant moment arms. A string that runs past a joint at that distance, on the side of
flexion for a positive one, has exactly this moment arm, so distances from joints are to scale. Where a muscle begins and
ends is not in the model: those places are drawn from anatomy by eye.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass

Point = tuple[float, float]

MUSCLES = (
    "anterior deltoid",
    "posterior deltoid",
    "biceps",
    "triceps, long head",
    "triceps, short head",
    "brachialis",
)
# Begin and end by eye, as shares of the bone they lie on: trunk, upper arm or forearm. Flexors end beyond the place at which a
# string at their distance bends where the elbow is flexed by 2.5 rad.
_ENDS = ((0.30, 0.50), (0.30, 0.42), (0.45, 0.28), (0.45, 0.10), (0.35, 0.10), (0.55, 0.22))
# Length of bone over which a string slants away from it.
_SLANT = 0.03
TRUNK = 0.16


@dataclass(frozen=True)
class ArmShape:
    """Two links and six muscles: `length` of the links in m, moment arms in m about shoulder and elbow, flexors positive."""

    length: tuple[float, float]
    shoulder_arms: tuple[float, ...]
    elbow_arms: tuple[float, ...]

    @classmethod
    def of(cls, parameters: Mapping[str, float]) -> "ArmShape | None":
        """The shape in a model's parameters, as the library's arm names them; None if they are not those of an arm."""
        try:
            length = (parameters["linkage.l[1]"], parameters["linkage.l[2]"])
            arms = [tuple(parameters[f"{name}[{k}]"] for k in range(1, len(MUSCLES) + 1)) for name in ("d1", "d2")]
        except KeyError:
            return None
        return cls(length, *arms)


# The physiological parameter set of the library's arm.
NOMINAL_ARM = ArmShape((0.33, 0.32), (0.05, -0.05, 0.03, -0.03, 0.0, 0.0), (0.0, 0.0, 0.03, -0.03, -0.03, 0.03))


@dataclass(frozen=True)
class Instant:
    """The arm at one moment; what is None is not drawn.

    `q` rad: shoulder from the world x axis, elbow relative to the upper arm, flexion positive. `torque` N.m: the residual
    torque on shoulder and elbow, positive in the direction of flexion; `torque_std` its standard deviation. `force` N on the
    arm at the wrist, world axes. `activation` of each muscle, 0 to 1. `modelled` rad: where the model puts the arm.
    """

    q: tuple[float, float]
    torque: tuple[float, float] | None = None
    torque_std: tuple[float, float] | None = None
    force: tuple[float, float] | None = None
    activation: tuple[float, ...] | None = None
    modelled: tuple[float, float] | None = None
    time: float | None = None


def joints(shape: ArmShape, q: tuple[float, float]) -> tuple[Point, Point, Point]:
    """Shoulder, elbow and wrist in m, world axes; the shoulder is the origin."""
    (l1, l2), (q1, q2) = shape.length, q
    elbow = (l1 * math.cos(q1), l1 * math.sin(q1))
    return (0.0, 0.0), elbow, (elbow[0] + l2 * math.cos(q1 + q2), elbow[1] + l2 * math.sin(q1 + q2))


@dataclass(frozen=True)
class Corner:
    """A string past a joint: straight to `enter`, then round the joint at `radius` to `leave` (the same point if it lifts off)."""

    enter: Point
    leave: Point
    radius: float
    left: bool


def corner(joint: Point, before: float, after: float, arm: float) -> Corner:
    """How a string at signed distance `arm` (m, left of the way positive) goes past a joint between two directions in rad.

    Outside the bend it lies on a circle of that radius, inside it is straight up to the crossing of both lines; each
    straight part is `arm` away from the joint in both cases.
    """
    bend = math.remainder(after - before, math.tau)
    normals = [(-math.sin(angle), math.cos(angle)) for angle in (before, after)]
    if arm * bend > 0:
        share = arm / (1 + math.cos(max(min(bend, 2.8), -2.8)))
        point = (
            joint[0] + share * (normals[0][0] + normals[1][0]),
            joint[1] + share * (normals[0][1] + normals[1][1]),
        )
        return Corner(point, point, abs(arm), bend > 0)
    enter, leave = ((joint[0] + arm * x, joint[1] + arm * y) for x, y in normals)
    return Corner(enter, leave, abs(arm), bend > 0)


# A place beside a bone (which bone: trunk 0, upper arm 1, forearm 2; m along it; m to its left), or a joint passed at a distance.
Beside = tuple[int, float, float]
Passed = tuple[int, float]


def strings(shape: ArmShape) -> tuple[tuple[Beside | Passed, ...], ...]:
    """The way of each muscle: two places where it begins, the joints it passes, two places where it ends."""
    lengths = (TRUNK, *shape.length)
    found: list[tuple[Beside | Passed, ...]] = []
    for (begin, end), *arms in zip(_ENDS, shape.shoulder_arms, shape.elbow_arms, strict=True):
        passed = [(joint, arm) for joint, arm in enumerate(arms) if arm]
        if not passed:
            found.append(())
            continue
        (first, arm), (last, arm_last) = passed[0], passed[-1]
        start, stop = begin * lengths[first], end * lengths[last + 1]
        before = ((first, start, 0.0), (first, start + _SLANT, arm))
        after = ((last + 1, stop + _SLANT, arm_last), (last + 1, stop + 2 * _SLANT, 0.0))
        found.append((*before, *passed, *after))
    return tuple(found)


def muscle_path(shape: ArmShape, q: tuple[float, float], muscle: int) -> tuple[Point | Corner, ...]:
    """Points and corners of a muscle (0 to 5) from begin to end, in m, world axes."""
    shoulder, elbow, _ = joints(shape, q)
    directions, starts = (0.0, q[0], q[0] + q[1]), ((-TRUNK, 0.0), shoulder, elbow)
    path: list[Point | Corner] = []
    for knot in strings(shape)[muscle]:
        if len(knot) == 2:
            joint, arm = knot
            path.append(corner((shoulder, elbow)[joint], directions[joint], directions[joint + 1], arm))
        else:
            bone, along, distance = knot
            path.append(_beside(starts[bone], directions[bone], along, distance))
    return tuple(path)


def _beside(start: Point, direction: float, along: float, distance: float) -> Point:
    c, s = math.cos(direction), math.sin(direction)
    return start[0] + along * c - distance * s, start[1] + along * s + distance * c
