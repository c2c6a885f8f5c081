"""The arm of a session as it stands now: the emulated one as the report draws it, or the robot's links from two sides."""

from functools import lru_cache
from itertools import product

import numpy as np

from hil.bench_view.tables import joints_at_a_limit
from hil.bench_view.watched import Watched
from hil.robots.chain import Chain
from orchestrator.report.arm_drawing import ArmShape, Instant, Scales, arm_svg
from orchestrator.report.palette import Colour

# Fixed, so that pictures of different moments can be compared: a quarter turn is 1 N.m, 10 cm are 20 N; metres in view.
SCALES = Scales(turn=1.5708, length=0.005, box=(-0.35, -0.22, 0.7, 0.7))
_ARROWS = "Round arrows: residual torque, a quarter turn is 1 N.m. Straight arrow: force on the wrist, 10 cm are 20 N."
# The robot's two views in pixels, and how closely its range of motion is looked through for what they have to show.
_HEIGHT, _GAP, _STEPS = 230, 40, 5
_VIEWS = (("from above", (0, 1)), ("from the side", (0, 2)))
# Joints that lie closer together in a view share their numbers, in pixels.
_NEAR = 12


def arm_picture(seen: Watched) -> str:
    """The emulated arm if there is one, else the robot, each with words on how to read it."""
    if (q := seen.arm_angles) is not None:
        words = (
            _ARROWS
            if seen.map is not None
            else "The emulated arm; muscles are drawn thicker and darker the more they pull."
        )
        return f"{_emulated(seen, q)}<p>{words}</p>"
    if "chain" in seen.about and seen.glance is not None:
        marked = " Red: a joint at a limit." if joints_at_a_limit(seen, seen.glance) else ""
        return f"{robot_svg(seen)}<p>The robot from above and from the side; numbers are its joints.{marked}</p>"
    return "<p>This robot's links are not known here, so it is not drawn; its joints stand in the table.</p>"


def _emulated(seen: Watched, q: np.ndarray) -> str:
    """The arm with its residual torque, the force on its wrist and its muscles."""
    arm = seen.about["arm"]
    shoulder, elbow = (tuple(map(float, row)) for row in arm["moment_arms"])
    shape = ArmShape((float(arm["length"][0]), float(arm["length"][1])), shoulder, elbow)
    torque, deviation, force = (seen.pair(name) for name in ("residual", "residual_sd", "pull"))
    instant = Instant(
        (float(q[0]), float(q[1])),
        torque=None if torque is None else (float(torque[0]), float(torque[1])),
        torque_std=None if deviation is None else (float(deviation[0]), float(deviation[1])),
        force=None if force is None else (float(force[0]), float(force[1])),
        activation=tuple(seen.signal(f"alpha_{k}") or 0.0 for k in range(1, 7)),
    )
    return arm_svg(instant, shape, SCALES)


def robot_svg(seen: Watched) -> str:
    """The robot's links seen from above and from the side, to one scale that shows its whole range of motion."""
    assert seen.glance is not None
    links, axes, base = seen.about["chain"]
    limits = seen.about["joints"]
    ranges = tuple((float(joint["low"]), float(joint["high"])) for joint in limits)
    chain = Chain(tuple(map(tuple, links)), tuple(map(tuple, axes)), tuple(base))
    places = chain.places(seen.glance.angles[: len(links)])
    low, high = _box(chain, ranges)
    scale = _HEIGHT / max(float((high - low)[1:].max()), 1e-3)
    marked, left, parts = joints_at_a_limit(seen, seen.glance), 0.0, []
    for name, kept in _VIEWS:
        points = (places - low)[:, kept] * scale * [1.0, -1.0] + [left, _HEIGHT]
        parts.append(_view(name, points, left, marked))
        left += float((high - low)[0]) * scale + _GAP
    tip = ", ".join(f"{value:.2f}" for value in places[-1])
    return (
        f'<svg class="robot" role="img" aria-label="The robot from above and from the side; its tip is at {tip} m"'
        f' viewBox="-12 -24 {left - _GAP + 24:.0f} {_HEIGHT + 36}" font-family="system-ui, sans-serif" font-size="13">'
        f"{''.join(parts)}</svg>"
    )


def _view(name: str, points: np.ndarray, left: float, marked: set[int]) -> str:
    """Links as a line, joints as circles with their numbers; joint k turns the links behind the place 2 k - 2."""
    course = " ".join(f"{x:.1f},{y:.1f}" for x, y in points)
    found = [
        f'<text x="{left:.0f}" y="-8" fill="{Colour.QUIET}">{name}</text>',
        f'<polyline points="{course}" fill="none" stroke="{Colour.QUIET}" stroke-width="8" stroke-linejoin="round" stroke-linecap="round"/>',
    ]
    groups: list[tuple[np.ndarray, list[int]]] = []
    for joint, point in enumerate(points[:-1:2], start=1):
        near = next((names for place, names in groups if np.hypot(*(place - point)) < _NEAR), None)
        if near is None:
            groups.append((point, [joint]))
        else:
            near.append(joint)
    for (x, y), names in groups:
        colour = Colour.BAD if marked & set(names) else Colour.INK
        found.append(f'<circle cx="{x:.1f}" cy="{y:.1f}" r="6" fill="{colour}"/>')
        found.append(
            f'<text x="{x + 10:.1f}" y="{y - 8:.1f}" font-weight="700" fill="{colour}">{", ".join(map(str, names))}</text>'
        )
    return "".join(found)


@lru_cache(maxsize=8)
def _box(chain: Chain, ranges: tuple[tuple[float, float], ...]) -> tuple[np.ndarray, np.ndarray]:
    """Least and greatest coordinates (3,) in m that any place of the robot comes to within its ranges."""
    postures = product(*(np.linspace(low, high, _STEPS) for low, high in ranges))
    places = np.concatenate([chain.places(angles) for angles in postures])
    return places.min(axis=0), places.max(axis=0)
