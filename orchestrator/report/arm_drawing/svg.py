"""One instant of the arm as an SVG image that needs nothing from outside."""

import html
import math

from orchestrator.report.arm_drawing.arrows import Scales, arc_path, force_path, polyline, torque_path
from orchestrator.report.arm_drawing.shape import (
    MUSCLES,
    NOMINAL_ARM,
    TRUNK,
    ArmShape,
    Corner,
    Instant,
    joints,
    muscle_path,
)
from orchestrator.report.numbers import quantity
from orchestrator.report.palette import SURFACES, Colour

# A normal error lies within so many standard deviations with a probability of 90 %.
_Z90 = 1.645


def arm_svg(instant: Instant, shape: ArmShape = NOMINAL_ARM, scales: Scales | None = None, title: str = "") -> str:
    """Return an `<svg>` element of the arm; its classes `link`, `muscle`, `torque`, `spread`, `force` and `ghost` name the parts.

    Args:
        scales: sizes of arrows and the part in view; those that suit this instant if left out.
        title: what the picture shows, for those who do not see it; the instant's numbers if left out.
    """
    scales = scales or Scales.of(shape, [instant])
    left, bottom, right, top = (1000 * edge for edge in scales.box)
    view = f"{left:.0f} {-top:.0f} {right - left:.0f} {top - bottom:.0f}"
    # Joints and torques above, muscles below the outline: what matters most is never hidden.
    parts = "".join(
        (
            _body(),
            _ghost(instant, shape),
            _links(instant, shape),
            _muscles(instant, shape),
            _arrows(instant, shape, scales),
        )
    )
    label = html.escape(title or described(instant))
    return f'<svg class="arm" xmlns="http://www.w3.org/2000/svg" viewBox="{view}" role="img" aria-label="{label}">{parts}</svg>'


def described(instant: Instant) -> str:
    """The numbers of an instant as a sentence, with units and uncertainty."""
    parts = [f"shoulder {quantity(instant.q[0], 'rad')}, elbow {quantity(instant.q[1], 'rad')}"]
    if instant.torque is not None:
        spread = instant.torque_std or (0.0, 0.0)
        names = zip(("shoulder", "elbow"), instant.torque, spread, strict=True)
        torques = (f"{name} {quantity(t, 'N.m')}{_within(s)}" for name, t, s in names)
        parts.append(f"residual torque {', '.join(torques)}")
    if instant.force is not None:
        parts.append(f"force at the wrist {quantity(math.hypot(*instant.force), 'N')}")
    moment = "" if instant.time is None else f" at {instant.time:.2f} s"
    return f"The arm{moment}: {'; '.join(parts)}."


def _within(std: float) -> str:
    return f" ± {quantity(_Z90 * std, 'N.m')} (90 %)" if std else ""


def _body() -> str:
    """The trunk, from which shoulder muscles come; its end only, as it does not move."""
    line = polyline([(-TRUNK, 0.0), (0.0, 0.0)])
    return f'<path d="{line}" stroke="{SURFACES["rule"]}" stroke-width="70" stroke-linecap="round" fill="none"/>'


def _links(instant: Instant, shape: ArmShape) -> str:
    places = joints(shape, instant.q)
    lines = [polyline(places[:2]), polyline(places[1:])]
    drawn = [
        f'<g fill="none" stroke-linecap="round" stroke="{colour}" stroke-width="{width}">'
        + "".join(f'<path class="link" d="{line}"/>' for line in lines)
        + "</g>"
        for colour, width in ((Colour.INK, 34), (SURFACES["tint"], 29))
    ]
    circles = "".join(
        f'<circle class="joint" cx="{1000 * x:.1f}" cy="{-1000 * y:.1f}" r="9" fill="{Colour.INK}"/>' for x, y in places
    )
    return "".join(drawn) + circles


def _ghost(instant: Instant, shape: ArmShape) -> str:
    line = polyline(joints(shape, instant.modelled)) if instant.modelled else ""
    return f'<path class="ghost" d="{line}" fill="none" stroke="{Colour.MODEL}" stroke-width="8" stroke-dasharray="16 10"/>'


def _muscles(instant: Instant, shape: ArmShape) -> str:
    """Strings that are thicker and darker the more they are activated."""
    paths = []
    for k, name in enumerate(MUSCLES):
        active = 0.3 if instant.activation is None else max(0.0, min(1.0, instant.activation[k]))
        line = _string(muscle_path(shape, instant.q, k))
        paths.append(
            f'<path class="muscle" d="{line}" stroke-width="{4 + 14 * active:.1f}" opacity="{0.35 + 0.65 * active:.2f}">'
            f"<title>{name}</title></path>"
        )
    return (
        f'<g fill="none" stroke="{Colour.MUSCLE}" stroke-linejoin="round" stroke-linecap="round">{"".join(paths)}</g>'
    )


def _string(path: tuple[tuple[float, float] | Corner, ...]) -> str:
    parts = []
    for part in path:
        if not isinstance(part, Corner):
            parts.append(f"L{1000 * part[0]:.1f} {-1000 * part[1]:.1f}")
            continue
        parts.append(f"L{1000 * part.enter[0]:.1f} {-1000 * part.enter[1]:.1f}")
        if part.leave != part.enter:
            radius = f"{1000 * part.radius:.1f}"
            flags = f"0 0 {int(not part.left)}"
            parts.append(f"A{radius} {radius} {flags} {1000 * part.leave[0]:.1f} {-1000 * part.leave[1]:.1f}")
    return " ".join(parts).replace("L", "M", 1)


def _arrows(instant: Instant, shape: ArmShape, scales: Scales) -> str:
    shoulder, elbow, wrist = joints(shape, instant.q)
    spreads, torques = [], []
    directions = (instant.q[0], instant.q[0] + instant.q[1])
    for k, (centre, direction) in enumerate(zip((shoulder, elbow), directions, strict=True)):
        torque = instant.torque[k] if instant.torque else 0.0
        half = _Z90 * scales.turn * (instant.torque_std[k] if instant.torque_std else 0.0)
        end = direction + torque * scales.turn
        spreads.append(arc_path(centre, end - half, end + half) if half else "")
        torques.append(torque_path(centre, direction, torque, scales.turn))
    force = force_path(wrist, instant.force, scales.length) if instant.force else ""
    return (
        f'<g fill="none" stroke="{Colour.RESIDUAL}" stroke-width="26" opacity="0.3">'
        + "".join(f'<path class="spread" d="{line}"/>' for line in spreads)
        + f'</g><g fill="none" stroke="{Colour.RESIDUAL}" stroke-width="10" stroke-linejoin="round">'
        + "".join(f'<path class="torque" d="{line}"/>' for line in torques)
        + f'</g><path class="force" d="{force}" fill="none" stroke="{Colour.FORCE}" stroke-width="10" stroke-linejoin="round"/>'
    )
