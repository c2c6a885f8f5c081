"""The bench view's page: what a session shows, and its stop button. It has no other way to the robot."""

from html import escape

from nicegui import ui

from hil.bench_view import pictures, tables
from hil.bench_view.arm_picture import arm_picture
from hil.bench_view.sentences import Said, doing, state
from hil.bench_view.stop_bar import SIGN, stop_bar
from hil.bench_view.watched import Sessions, Watched
from hil.robots.absent import warning
from orchestrator.report.palette import SURFACES, Colour
from orchestrator.studio.pages import Page

CSS = f"""
.bench-state {{ padding: 10px 14px; border-left: 8px solid {Colour.QUIET}; background: {SURFACES["tint"]}; min-height: 4.2em; margin: 8px 0; }}
.bench-good {{ border-color: {Colour.GOOD}; }}
.bench-warning {{ border-color: {Colour.WARNING}; }}
.bench-bad {{ border-color: {Colour.BAD}; border-left-width: 16px; }}
.bench-state strong {{ display: block; font-size: 1.2rem; }}
.bench-grid {{ display: grid; grid-template-columns: repeat(auto-fit, minmax(min(100%, 480px), 1fr)); gap: 8px 32px; align-items: start; }}
.bench-column {{ min-width: 0; display: flex; flex-direction: column; gap: 8px; }}
.bench-part {{ min-width: 0; overflow-x: auto; }}
.bench-part:empty {{ display: none; }}
.bench-part svg {{ max-width: 100%; height: auto; }}
.bench-part svg.arm {{ max-height: 320px; width: 100%; }}
.bench-part svg.robot {{ max-height: 300px; width: 100%; }}
.bench-table {{ border-collapse: collapse; font-variant-numeric: tabular-nums; width: 100%; font-size: 0.92rem; }}
.bench-table th, .bench-table td {{ text-align: right; padding: 4px 6px; border-bottom: 1px solid {SURFACES["rule"]}; white-space: nowrap; }}
.bench-table thead th {{ white-space: normal; vertical-align: bottom; color: {Colour.QUIET}; }}
@media (max-width: 600px) {{ .bench-table {{ font-size: 0.72rem; }} .bench-table th, .bench-table td {{ padding: 4px 2px; white-space: normal; }} }}
.bench-near {{ color: {Colour.BAD}; }}
.bench-hidden {{ position: absolute; left: -9999px; }}
.bench-part dl {{ display: grid; grid-template-columns: repeat(auto-fit, minmax(130px, 1fr)); gap: 4px 16px; margin: 4px 0; font-variant-numeric: tabular-nums; }}
.bench-part dt {{ color: {Colour.QUIET}; font-size: 0.85rem; }}
.bench-part dd {{ margin: 0; font-weight: 600; }}
.bench-faults li {{ margin: 0 0 10px; overflow-wrap: anywhere; }}
.bench-faults span {{ color: {Colour.QUIET}; }}
.bench-maps {{ display: flex; flex-wrap: wrap; gap: 8px; }}
.bench-maps figure {{ margin: 0; flex: 1 1 220px; max-width: 330px; }}
.bench-others ul {{ display: inline; padding: 0; }}
.bench-others li {{ display: inline; margin-right: 16px; }}
"""


PATH = "/bench"
# How often the page is drawn anew, and its maps, in s.
REFRESH_S, MAPS_EVERY = 0.25, 4

SESSIONS = Sessions()

START = """<h2>No session runs on this machine</h2>
<p>Start one in a terminal; this page finds it by itself:</p>
<pre>misfit hil hold --virtual --seconds 60
misfit hil record study --virtual --out session-1</pre>
<p>The first holds a virtual robot where it is, the second runs the study's trials on a virtual arm. With a real robot, say
<code>--bench FILE</code> instead of <code>--virtual</code>. A session without this page has the same limits and the same watchdog;
Ctrl-C in its terminal and the pendant stop it as well.</p>"""


def register() -> Page:
    """The page of the bench."""
    return Page(PATH, "Bench", build, order=40)


def build() -> None:
    """The session that the address names, or the newest; the page and its stop button stay with it."""
    SESSIONS.find()
    request = ui.context.client.request
    wanted = request.query_params.get("session")
    seen = SESSIONS.chosen(wanted)
    if seen is not None and wanted is None:  # from now on the address names it, also if the page is loaded again
        wanted = seen.name
        ui.add_body_html(f'<script>history.replaceState(null, "", "?session={seen.name}")</script>')
    ui.add_body_html(stop_bar(seen, request.url.hostname or ""))
    ui.add_head_html(f"<style>{CSS}</style>")
    ui.html("<h1>Bench</h1>", sanitize=False)
    _View(seen, wanted).begin()


class _View:
    """What one browser window shows."""

    def __init__(self, seen: Watched | None, wanted: str | None) -> None:
        self.seen, self.wanted, self.turn = seen, wanted, -1
        self.shown = _shown(seen)
        # Only what changes of itself is announced to those who listen instead of looking.
        self.state = ui.html("", sanitize=False).props("role=status aria-live=polite")
        self.warning = ui.html("", sanitize=False).props("role=alert")
        self.others = ui.html("", sanitize=False)
        self.sign = ui.html("", sanitize=False).classes("bench-hidden").props("aria-hidden=true")
        with ui.element("div").classes("bench-grid"):
            self.parts = {name: part for column in _COLUMNS for name, part in _column(column).items()}

    def begin(self) -> None:
        """Draw now, and again and again."""
        self.draw()
        ui.timer(REFRESH_S, self.draw)

    def draw(self) -> None:
        """Draw what has changed; a session that has begun or found its stop button needs a page with that button."""
        SESSIONS.begin()
        self.turn += 1
        self.sign.set_content(f'<span id="{SIGN}">{self.turn}</span>')
        if _shown(chosen := SESSIONS.chosen(self.wanted)) != self.shown and not (chosen is None or chosen.is_over):
            self.shown = _shown(chosen)
            ui.navigate.to(f"{PATH}?session={chosen.name}")
            return
        seen = self.seen
        self.others.set_content(_others(seen))
        if seen is None or seen.glance is None:
            self.state.set_content(_nothing(self.wanted) if seen is None else _state(state(seen)))
            return
        self.state.set_content(_state(state(seen)))
        self.warning.set_content(_without(seen) + (_DEAD if seen.stop_is_dead else ""))
        for name, draw in _PARTS.items():
            if self.turn % MAPS_EVERY == 0 or name not in _SLOW:
                self.parts[name].set_content(draw(seen))


def _nothing(wanted: str | None) -> str:
    """What is said where there is nothing to show; a page that was for one session does not turn to another by itself."""
    if wanted is None or not SESSIONS.all():
        return START
    return "<h2>The session of this page is gone</h2><p>Others run or have ended on this machine; choose one above.</p>"


def _without(seen: Watched) -> str:
    """What is said all the time of a session that does without safeguards."""
    words = warning(seen.about.get("without", ()))
    return f'<p class="bench-state bench-bad"><strong>{escape(words)}</strong></p>' if words else ""


_DEAD = """<p class="bench-state bench-bad"><strong>The stop button on this page is dead.</strong> The session goes on without it. Stop it with
the pendant, or with Ctrl-C in its terminal.</p>"""


def _shown(seen: Watched | None) -> tuple[str, int]:
    """What the stop bar was made for."""
    return ("", 0) if seen is None else (seen.name, seen.stop.port if seen.stop is not None else 0)


def _column(names: tuple[str, ...]) -> dict[str, ui.html]:
    with ui.element("div").classes("bench-column"):
        return {name: ui.html("", sanitize=False).classes("bench-part") for name in names}


def _state(said: Said) -> str:
    return f'<p class="bench-state bench-{said.tone}"><strong>{tables.prose(said.headline)}</strong> {tables.prose(said.more)}</p>'


def _others(seen: Watched | None) -> str:
    """Links to the other sessions, if there are any."""
    found = SESSIONS.all()
    if all(each is seen for each in found):
        return ""
    links = (
        f"<li>{_name(each)} (shown)</li>"
        if each is seen
        else f'<li><a href="{PATH}?session={each.name}">{_name(each)}</a></li>'
        for each in found
    )
    return f'<nav aria-label="Sessions" class="bench-others">Sessions: <ul>{"".join(links)}</ul></nav>'


def _name(seen: Watched) -> str:
    return escape(f"{seen.title}: {seen.about.get('controller', '')}, {seen.life.value}")


def _joints(seen: Watched) -> str:
    assert seen.glance is not None
    return f"<h2>Joints</h2>{tables.joints(seen, seen.glance)}"


def _timing(seen: Watched) -> str:
    assert seen.glance is not None
    return f"<h2>Time</h2>{tables.timing(seen, seen.glance)}{pictures.histogram(seen.glance)}<p>Cycles by how late they began; heights are logarithmic.</p>"


def _faults(seen: Watched) -> str:
    return f"<h2>Faults</h2>{tables.fault_list(seen)}"


def _arm(seen: Watched) -> str:
    words = doing(seen)
    return f"<h2>{'Trial' if 'trials' in seen.about else 'Arm'}</h2>{f'<p>{escape(words)}</p>' if words else ''}{arm_picture(seen)}"


def _residual(seen: Watched) -> str:
    if seen.map is None:
        return (
            "<h2>Residual</h2><p>This session has no model of an arm to compare the robot with; <code>misfit hil record</code>"
            " has one, and learns what it lacks.</p>"
        )
    head = "<h2>Residual: where model and robot disagree now</h2>"
    if not seen.past:
        return f"{head}<p>Nothing to compare yet: the arm's controller has not been asked for a torque.</p>"
    return (
        f"{head}{tables.residual(seen)}"
        f"<h3>Shoulder</h3>{pictures.traces(seen.lately, 1)}<h3>Elbow</h3>{pictures.traces(seen.lately, 2)}"
        "<p>Solid: residual. Dashed, with its 90 % interval: what has been learned of it.</p>"
    )


def _maps(seen: Watched) -> str:
    if seen.map is None or not seen.past:
        return ""
    means, now = seen.map.means, seen.arm_angles
    low, high = seen.about["arm"]["low"], seen.about["arm"]["high"]
    drawn = (
        f"<figure><figcaption>{name}, N.m</figcaption>{pictures.residual_map(means[..., k], k + 1, low, high, now)}</figure>"
        for k, name in enumerate(("Shoulder", "Elbow"))
    )
    return f"<h2>Map of the residual</h2><div class='bench-maps'>{''.join(drawn)}</div><p>Averages by posture; the last minute counts most. The ring is the arm now.</p>"


_PARTS = {
    "joints": _joints,
    "faults": _faults,
    "arm": _arm,
    "timing": _timing,
    "residual": _residual,
    "maps": _maps,
}
# The arm and what it does stand in the first screen.
_COLUMNS = (("joints", "faults", "timing"), ("arm", "residual", "maps"))
_SLOW = ("maps", "timing")
