"""Tables of the bench view, as HTML: joints with their limits, the residual, and what went wrong."""

import re
from collections.abc import Iterator, Mapping, Sequence
from html import escape

import numpy as np

from hil.bench_view.pictures import Z90, micro
from hil.bench_view.sentences import Fault, faults
from hil.bench_view.watched import Watched
from hil.view.glance import Glance
from orchestrator.report.numbers import percent

# From this share of a limit on, a number is marked.
NEAR = 0.9


def joints(seen: Watched, glance: Glance) -> str:
    """Angle, speed, torque asked for and sent, each with its limits."""
    rows = []
    limits, most = seen.about.get("joints"), seen.about.get("force")
    if limits is None or most is None:
        return "<p>This session does not say what its limits are.</p>"
    for number, limit, angle, speed, sent, asked in _each_joint(seen, glance):
        cells = (
            _number(f"{angle:+.3f}", _is_outside(limit, angle)),
            f"{limit['low']:g} to {limit['high']:g}",
            _number(f"{speed:+.3f}", _is_near(limit["speed"], speed)),
            f"± {limit['speed']:g}",
            _number(f"{asked:+.2f}", abs(asked) > limit["torque"]),
            _number(f"{sent:+.2f}", _is_near(limit["torque"], sent)),
            f"± {limit['torque']:g}",
        )
        rows.append(f'<tr><th scope="row">{number}</th>{"".join(f"<td>{cell}</td>" for cell in cells)}</tr>')
    hidden = len(limits) - len(rows)
    more = f"<p>{hidden} more joints are not shown.</p>" if hidden else ""
    head = ("joint", "angle (rad)", "range", "speed (rad/s)", "limit", "asked (N.m)", "sent (N.m)", "limit")
    size = float(np.linalg.norm(glance.force))
    parts = ", ".join(f"{value:+.1f}" for value in glance.force)
    force = f"<p>Force at the wrist: {_number(f'{size:.1f} N', size >= NEAR * most)}, limit {most:g} N (x, y, z: {parts})</p>"
    return _table("Joints", head, rows) + more + force


def joints_at_a_limit(seen: Watched, glance: Glance) -> set[int]:
    """Numbers of joints that are outside of their range, or near a limit of speed or torque."""
    return {
        number
        for number, limit, angle, speed, sent, _ in _each_joint(seen, glance)
        if _is_outside(limit, angle) or _is_near(limit["speed"], speed) or _is_near(limit["torque"], sent)
    }


def _each_joint(seen: Watched, glance: Glance) -> Iterator[tuple[int, Mapping[str, float], float, float, float, float]]:
    """Number, limits, angle, speed, torque sent and asked for; a session's window has room for its first three joints."""
    values = zip(seen.about["joints"], glance.angles, glance.speeds, glance.torques, glance.asked, strict=False)
    return ((number, *each) for number, each in enumerate(values, start=1))


def _is_outside(limit: Mapping[str, float], angle: float) -> bool:
    return not limit["low"] <= angle <= limit["high"]


def _is_near(limit: float, value: float) -> bool:
    return abs(value) >= NEAR * limit


def timing(seen: Watched, glance: Glance) -> str:
    """How well the session keeps its time, in numbers."""
    asked = len(seen.about.get("joints", ())) * max(glance.cycles, 1)
    rate = "not known yet" if seen.rate_hz is None else f"{seen.rate_hz:.0f} of {1e9 / glance.period_ns:.0f} Hz"
    missing = f" of {asked} ({percent(glance.missing / asked)})" if asked else ""
    said = (
        ("rate", rate),
        ("late, median", f"{micro(glance.late_us(0.5))} at most"),
        ("late, 99 %", f"{micro(glance.late_us(0.99))} at most"),
        ("latest", micro(glance.latest_us)),
        ("cycles skipped", f"{glance.missed} of {glance.cycles + glance.missed}"),
        ("answers missing", f"{glance.missing}{missing}"),
    )
    return "<dl>" + "".join(f"<div><dt>{name}</dt><dd>{words}</dd></div>" for name, words in said) + "</dl>"


def residual(seen: Watched) -> str:
    """What the model knows, what it lacks, and what has been learned of that, by joint."""
    muscle, live, learned = (seen.pair(name) for name in ("muscle_tau", "residual", "learned"))
    unsure = seen.signal("unsure")
    if muscle is None or live is None or learned is None or unsure is None:
        return ""
    deviation = seen.pair("residual_sd")
    spread = ["", ""] if deviation is None else [f" ± {Z90 * value:.3f}" for value in deviation]
    rows = [
        f'<tr><th scope="row">{name}</th><td>{muscle[k]:+.3f}</td><td>{live[k]:+.3f}{spread[k]}</td>'
        f"<td>{learned[k]:+.3f} ± {Z90 * unsure:.3f}</td></tr>"
        for k, name in enumerate(("shoulder", "elbow"))
    ]
    head = ("joint", "muscles (N.m)", "residual (N.m)", "learned (N.m)")
    return _table("Residual", head, rows) + "<p>± is the 90 % interval.</p>"


def fault_list(seen: Watched) -> str:
    """What went wrong, in plain words, with the time and what to do."""
    found = faults(seen)
    if not found:
        return "<p>Nothing has gone wrong.</p>"
    return '<ol class="bench-faults">' + "".join(map(_fault, found)) + "</ol>"


def _fault(fault: Fault) -> str:
    happened, when, words, became, do = map(prose, (fault.happened, fault.when, fault.words, fault.became, fault.do))
    return (
        f"<li><strong>{happened}</strong> <span>{when}</span><br>{words}<br>"
        f"What became of it: {became}<br>What to do: {do}</li>"
    )


def prose(words: str) -> str:
    """Words with commands between backticks, as HTML."""
    return re.sub("`([^`]*)`", r"<code>\1</code>", escape(words))


def _number(words: str, marked: bool) -> str:
    return f'<strong class="bench-near">{words} !</strong>' if marked else words


def _table(caption: str, head: Sequence[str], rows: Sequence[str]) -> str:
    names = "".join(f'<th scope="col">{escape(name)}</th>' for name in head)
    return (
        f'<table class="bench-table"><caption class="bench-hidden">{escape(caption)}</caption>'
        f"<thead><tr>{names}</tr></thead><tbody>{''.join(rows)}</tbody></table>"
    )
