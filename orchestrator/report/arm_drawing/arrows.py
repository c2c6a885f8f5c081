"""Arrows as SVG paths, in thousandths of a metre with y downwards: round ones for torques, straight ones for forces."""

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from orchestrator.report.arm_drawing.shape import TRUNK, ArmShape, Instant, Point, joints
from orchestrator.report.numbers import quantity

RADIUS, HEAD = 0.075, 0.022
# The largest torque turns this far, and the largest force is this long; beyond it, live, arrows grow no further.
LARGEST_TURN, LARGEST_LENGTH = 4.2, 0.2
_MARGIN = 0.11


@dataclass(frozen=True)
class Scales:
    """How large things are drawn: rad of arc for 1 N.m, m for 1 N, and the part of the plane in view (m: left, bottom, right, top)."""

    turn: float
    length: float
    box: tuple[float, float, float, float]

    @classmethod
    def of(cls, shape: ArmShape, instants: Sequence[Instant]) -> "Scales":
        """Scales at which everything of these instants is seen, with the largest arrows at full size."""
        torque = max((abs(t) for i in instants for t in i.torque or ()), default=0.0)
        force = max((math.hypot(*i.force) for i in instants if i.force), default=0.0)
        points = [(-TRUNK, 0.0), *(p for i in instants for q in (i.q, i.modelled) if q for p in joints(shape, q))]
        low, high = ([f(p[k] for p in points) for k in (0, 1)] for f in (min, max))
        box = (low[0] - _MARGIN, low[1] - _MARGIN, high[0] + _MARGIN, high[1] + _MARGIN)
        return cls(LARGEST_TURN / torque if torque else 0.0, LARGEST_LENGTH / force if force else 0.0, box)

    def words(self) -> str:
        """What an arrow's size stands for, as a phrase; empty without arrows."""
        found = []
        if self.turn:
            found.append(f"a quarter turn is {quantity(math.pi / 2 / self.turn, 'N.m')}")
        if self.length:
            found.append(f"10 cm of straight arrow are {quantity(0.1 / self.length, 'N')}")
        return ", ".join(found)


def torque_path(centre: Point, direction: float, torque: float, turn: float) -> str:
    """An arrow round a joint: from the link's direction (rad), against the clock for a positive torque, `turn` rad for 1 N.m."""
    sweep = max(-LARGEST_TURN, min(LARGEST_TURN, torque * turn))
    if abs(sweep) * RADIUS < 1e-3:
        return ""
    end = direction + sweep
    # The head is part of the sweep, so that small arrows are no longer than they should be.
    head = min(HEAD / RADIUS, abs(sweep)) * math.copysign(1.0, sweep)
    tip, neck = _round(centre, end, RADIUS), end - head
    wings = [_round(centre, neck, RADIUS + side * 0.6 * abs(head) * RADIUS) for side in (1, -1)]
    return f"{arc_path(centre, direction, end)} M{_at(wings[0])} L{_at(tip)} L{_at(wings[1])}"


def arc_path(centre: Point, begin: float, end: float, radius: float = RADIUS) -> str:
    """An arc between two directions in rad."""
    large, clockwise = int(abs(end - begin) > math.pi), int(end < begin)
    size = round(1000 * radius, 1)
    return (
        f"M{_at(_round(centre, begin, radius))} A{size} {size} 0 {large} {clockwise} {_at(_round(centre, end, radius))}"
    )


def force_path(start: Point, force: tuple[float, float], length: float) -> str:
    """A straight arrow from the wrist, `length` m for 1 N."""
    size = math.hypot(*force)
    reach = min(LARGEST_LENGTH, size * length)
    if reach < 1e-3:
        return ""
    x, y = force[0] / size, force[1] / size
    tip, head = (start[0] + reach * x, start[1] + reach * y), min(HEAD, reach)
    neck = (tip[0] - head * x, tip[1] - head * y)
    wings = [(neck[0] - side * 0.6 * head * y, neck[1] + side * 0.6 * head * x) for side in (1, -1)]
    return f"M{_at(start)} L{_at(tip)} M{_at(wings[0])} L{_at(tip)} L{_at(wings[1])}"


def polyline(points: Iterable[Point]) -> str:
    """Points as an SVG path of straight lines."""
    return "M" + " L".join(map(_at, points))


def _round(centre: Point, angle: float, radius: float) -> Point:
    return centre[0] + radius * math.cos(angle), centre[1] + radius * math.sin(angle)


def _at(point: Point) -> str:
    return f"{1000 * point[0]:.1f} {-1000 * point[1]:.1f}"
