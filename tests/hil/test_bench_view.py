"""The bench view's parts: what it reads, how it says it, and that it has no way to the robot."""

import inspect
import json
import math
import re
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any
from xml.etree import ElementTree

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from nicegui import Client
from nicegui.page import page as nicegui_page
from starlette.requests import Request

from hil.bench_view import page, pictures
from hil.bench_view.advice import ADVICE, CAUSES, REACTIONS, advice
from hil.bench_view.arm_picture import arm_picture, robot_svg
from hil.bench_view.residual_map import CELLS, FORGETS_S, ResidualMap
from hil.bench_view.sentences import PHASES, doing, faults, plain, state
from hil.bench_view.stop_bar import NONE, NOT_THERE, stop_bar
from hil.bench_view.tables import fault_list, joints, timing
from hil.bench_view.watched import Life, Past, Sessions, Watched
from hil.codecs.barrett.safety_module import Button
from hil.robots.proficio import tool_position
from hil.safety.cycle import Reaction
from hil.safety.rules import RULES, Rule
from hil.session.loop import Loop, Wishes
from hil.stop.flag import StopFlag
from hil.stop.page import READY
from hil.stop.server import words_of
from hil.trials.controller import SIGNALS
from hil.trials.phases import Phase
from hil.view import layout
from hil.view.about import about
from hil.view.glance import Glance, Look
from hil.view.window import Window
from orchestrator.report.palette import Colour
from tests.hil.bench import SETTINGS, Bench, ExactTimer
from tests.hil.trial_session import some_trials


@pytest.fixture
def window() -> Iterator[Window]:
    """A window of a session of trials, and its stop flag."""
    flag = StopFlag.create()
    settings = replace(SETTINGS, protocol=some_trials(2))
    bench = Bench(settings=settings)
    known = about(settings, bench.pilot(), Path("/recordings/a b"), flag.path, dry_run=False)
    found = Window.create(2_000_000, known)
    yield found
    found.remove()
    flag.remove()


def stopped_session(window: Window) -> Watched:
    """What is seen of one that lost an answer, and then was switched off with the emergency stop."""
    bench = Bench()
    pilot, count = bench.pilot(), 0

    def wishes() -> Wishes:
        nonlocal count
        count += 1
        if count == 100:
            left = [1]
            bench.faults.towards_host.append(
                lambda timed: [timed] if not left or timed.frame.identifier != 0x423 or not left.pop() else []
            )
        if count == 200:
            bench.robot.safety.press(Button.ESTOP, bench.bus.time_ns)
        return Wishes(arm=not pilot.is_armed and count < 50, over=count > 300)

    Loop(bench.wire, pilot, ExactTimer(bench), window=window).run(wishes)
    seen = Watched.open(window.path)
    seen.glance = seen.look.look()
    return seen


@pytest.mark.parametrize("rule", [rule.__name__ for rule in RULES])
def test_every_rule_of_the_safety_core_is_told_in_plain_words_with_what_to_do(rule: str) -> None:
    happened, do = ADVICE[rule]
    assert happened.endswith((".", "?")) and do.endswith(".")
    assert "_" not in happened and plain(f"{rule}: 3 N.m").startswith(happened.removesuffix("."))


@pytest.mark.parametrize("rule", RULES, ids=lambda rule: rule.__name__)
def test_a_fault_is_told_by_its_own_cause_and_not_by_all_that_may_break_its_rule(rule: Rule) -> None:
    source = inspect.getsource(rule)
    causes = CAUSES.get(rule.__name__, ())
    told = [ADVICE[rule.__name__], *(meant for _, meant in causes)]
    assert all(part in source for part, _ in causes), "the safety core does not say so"
    assert all(advice(rule.__name__, f"some {part} words") == meant for part, meant in causes)
    assert all(" or " not in each.happened and each.happened.endswith(".") and each.do.endswith(".") for each in told)


def test_every_reaction_and_phase_has_words() -> None:
    assert set(REACTIONS) == set(Reaction)
    assert set(PHASES) == set(Phase)


def test_faults_are_listed_with_their_time_the_gravest_before_what_followed_from_it(window: Window) -> None:
    found = faults(stopped_session(window))
    assert [fault.happened for fault in found] == [
        "The emergency stop was pressed.",
        ADVICE["positions_answered"].happened,
    ]
    assert found[0].words == "emergency stop (module_agrees)"
    assert re.fullmatch(r"\d\d:\d\d:\d\d, from 0.20 to 0.40 s, \d+ cycles", found[1].when)
    assert found[0].became.startswith("Nothing was sent any more")


def test_a_session_without_a_fault_is_said_to_have_none(window: Window) -> None:
    bench = Bench()
    pilot, cycles = bench.pilot(), iter(range(1000))
    Loop(bench.wire, pilot, ExactTimer(bench), window=window).run(
        lambda: Wishes(arm=not pilot.is_armed, over=next(cycles) > 100)
    )
    assert pilot.is_armed
    seen = Watched.open(window.path)
    seen.glance = seen.look.look()
    assert fault_list(seen) == "<p>Nothing has gone wrong.</p>"
    assert "Nothing has gone wrong" not in fault_list(stopped_session(window))


@pytest.mark.parametrize("life", list(Life))
def test_every_life_of_a_session_has_a_headline_and_says_what_to_know(window: Window, life: Life) -> None:
    seen = stopped_session(window)
    seen.life = life
    said = state(seen)
    assert said.headline.endswith(".") and said.more
    if life in (Life.ENDED, Life.KILLED):
        assert "misfit hil replay '/recordings/a b'" in said.more
    seen.glance = None
    assert state(seen).headline.endswith(".")


def test_a_stopped_session_says_why(window: Window) -> None:
    seen = stopped_session(window)
    seen.life = Life.RUNNING
    assert seen.glance is not None
    seen._seen_s -= 1.0
    assert state(seen).headline.startswith("The session is stuck")
    seen._seen_s += 1.0
    said = state(seen)
    assert said.tone == "bad"
    assert said.headline == "Stopped. The emergency stop was pressed (emergency stop)."


def test_the_state_of_trials_is_a_sentence(window: Window) -> None:
    seen = Watched.open(window.path)
    names = [signal.name for signal in SIGNALS]
    shown = [0.0] * layout.SIGNALS
    shown[names.index("trial")], shown[names.index("phase")] = 2.0, float(Phase.ANNOUNCE)
    assert doing(seen) == ""
    stopped_session(window)
    glance = seen.look.look()
    assert glance is not None
    seen.glance = replace(glance, shown=tuple(shown))
    assert doing(seen).startswith("Trial 2 of 2: take hold of the arm")


def test_what_a_session_says_of_itself_fits_its_window_with_the_longest_names(window: Window) -> None:
    known = Look(window.path).about
    assert len(SIGNALS) <= layout.SIGNALS
    assert len(json.dumps(dict(known))) + 2 * 4096 // 2 < layout.ABOUT  # paths of 4096 bytes are the longest
    assert known["arm"]["low"] < known["arm"]["high"]
    assert known["trials"] == 2


def test_who_looks_cannot_write(window: Window) -> None:
    seen = Watched.open(window.path)
    assert seen.stop is not None
    for numbers in (seen.look._numbers, seen.stop._numbers):
        with pytest.raises(TypeError):
            numbers[0] = 1.0


def test_no_part_of_the_page_listens_to_the_browser(window: Window, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(page, "SESSIONS", Sessions())
    stopped_session(window)
    scope = {"type": "http", "method": "GET", "path": "/bench", "query_string": b"", "scheme": "http"}
    request = Request(scope | {"headers": [(b"host", b"127.0.0.1:80")], "server": ("127.0.0.1", 80)})
    with Client(nicegui_page("/bench"), request=request) as client:
        page.build()
    drawn = [element for element in client.elements.values() if element.id != 0]  # 0 is NiceGUI's own
    assert any("emergency stop" in str(element._props.get("innerHTML", "")) for element in drawn)
    assert [element for element in drawn if element._event_listeners] == []
    client.delete()


@pytest.mark.parametrize(("host", "other"), [("127.0.0.1", "localhost"), ("localhost", "127.0.0.1")])
def test_the_button_lies_on_another_site_than_the_page(window: Window, host: str, other: str) -> None:
    seen = Watched.open(window.path)
    assert seen.stop is not None
    assert stop_bar(seen, host) == NOT_THERE  # its server is not up yet
    StopFlag(seen.stop.path).listen(4321)
    assert f'src="http://{other}:4321/{seen.stop.token}/"' in stop_bar(seen, host)
    seen.life = Life.ENDED
    assert stop_bar(seen, host) == NONE
    assert stop_bar(None, host) == NONE


counts = st.lists(st.floats(0.0, 2e5), min_size=1, max_size=50)


@given(counts, st.floats(0.01, 1.0))
def test_a_share_of_lateness_lies_within_its_class(late: list[float], share: float) -> None:
    """Against numpy's quantile by the inverse of the distribution; classes are at most 4/3 wide."""
    classes = np.bincount(np.searchsorted(layout.EDGES, late, side="right"), minlength=len(layout.EDGES) + 1)
    glance = _glance(tuple(classes.tolist()), max(late))
    exact = float(np.quantile(late, share, method="inverted_cdf"))
    found = glance.late_us(share)
    assert found >= exact or math.isclose(found, exact)
    assert found <= max(4 / 3 * exact, 1.0) + 1e-9 or found == max(late)


def _glance(lateness: tuple[int, ...], latest: float) -> Glance:
    three = (0.0,) * 3
    head = (2e6, 0.0, latest, 0.0, sum(lateness), 0, 0, 0, 1)
    return Glance(*head, three, three, three, three, three, (0.0,) * layout.SIGNALS, lateness, (), "")


def test_the_map_averages_a_cell_and_forgets() -> None:
    found = ResidualMap(np.zeros(2), np.ones(2))
    here = np.array([0.31, 0.72])
    found.add(0.0, here, np.array([1.0, -1.0]))
    found.add(FORGETS_S, here, np.array([0.0, 3.0]))
    weight = math.exp(-1.0)
    cell = found.cell(here)
    assert cell == (int(0.31 * CELLS), int(0.72 * CELLS))
    assert found.means[cell] == pytest.approx([weight / (1 + weight), (3 - weight) / (1 + weight)])
    assert np.isfinite(found.means[..., 0]).sum() == 1
    found.add(10 * FORGETS_S, np.array([0.9, 0.9]), np.zeros(2))
    assert np.isnan(found.means[cell]).all()


@given(st.tuples(st.floats(), st.floats()).map(np.array), st.tuples(st.floats(), st.floats()).map(np.array))
def test_the_map_holds_no_value_that_was_not_measured(angles: np.ndarray, residual: np.ndarray) -> None:
    found = ResidualMap(np.zeros(2), np.ones(2))
    found.add(0.0, angles, residual)
    seen = found.means[np.isfinite(found.means)]
    assert len(seen) in (0, 2)
    assert set(seen.tolist()) <= set(residual.tolist())


def test_pictures_are_well_formed_and_say_their_numbers() -> None:
    means = np.full((CELLS, CELLS), np.nan)
    means[3, 4] = -0.5
    drawn = pictures.residual_map(means, 1, [0.0, 0.1], [1.0, 2.0], np.array([0.25, 1.0]))
    assert "1 of 400 cells" in drawn and "0.500 N.m" in drawn and pictures.diverging(-1.0) in drawn
    past = [Past(float(k), np.array([0.1, -0.2]), np.array([0.05, 0.0]), 0.1) for k in range(3)]
    curves = pictures.traces(past, 2)
    assert "residual now -0.200 N.m, learned 0 N.m, ± 0.164 N.m (90 %)" in curves
    late = pictures.histogram(_glance((5, *[0] * (len(layout.EDGES) - 1), 1), 2e5))
    assert "half within 1.00 µs" in late and "the latest 200 ms" in late
    for svg in (drawn, curves, late, pictures.traces([], 1)):
        ElementTree.fromstring(svg)


def test_a_page_and_its_button_stay_with_one_session_and_name_it(
    window: Window, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(page, "SESSIONS", Sessions())
    seen = stopped_session(window)
    views, bodies = [], []
    monkeypatch.setattr(page._View, "begin", lambda view: views.append(view))
    monkeypatch.setattr("nicegui.ui.add_body_html", bodies.append)
    scope = {"type": "http", "method": "GET", "path": "/bench", "query_string": b"", "scheme": "http"}
    request = Request(scope | {"headers": [(b"host", b"127.0.0.1:80")], "server": ("127.0.0.1", 80)})
    with Client(nicegui_page("/bench"), request=request) as client:
        page.build()
    client.delete()
    [view] = views
    name = view.wanted
    assert name is not None and f"?session={name}" in bodies[0]
    other = Window.create(2_000_000, {"name": "session 2 with a colleague's robot"})
    try:
        page.SESSIONS.find()
        chosen = page.SESSIONS.chosen(name)
        assert chosen is not None and chosen.look.path == window.path != other.path
        assert len(page.SESSIONS.all()) == 2
        # A page whose session is gone names the others, and does not say that there are none.
        assert "colleague" in page._others(None) and "choose one above" in page._nothing("gone")
    finally:
        other.remove()
    assert seen is not None


def test_the_button_says_which_session_and_robot_it_stops(window: Window) -> None:
    seen = Watched.open(window.path)
    assert seen.stop is not None
    flag = StopFlag(seen.stop.path)
    flag.listen(4321)
    assert f"Stops <strong>{seen.title}</strong>" in stop_bar(seen, "localhost")
    assert "session " in seen.title and "(right, " in seen.title
    flag.stops(seen.title)
    assert words_of(flag) == (f"{READY} Stops {seen.title}.", False)


def test_the_emulated_arm_is_drawn_where_the_joints_are_before_its_controller_has_been_asked(window: Window) -> None:
    seen = stopped_session(window)
    assert seen.glance is not None
    seen.glance = replace(seen.glance, angles=(0.0, 0.2, 1.5), shown=(0.0,) * layout.SIGNALS)
    assert seen.arm_angles == pytest.approx([SETTINGS.shoulder + 0.2, 1.5])
    assert "Round arrows" in arm_picture(seen)
    seen.past.clear()
    assert "Nothing to compare yet" in page._residual(seen) and page._maps(seen) == ""


def test_a_robot_without_an_emulated_arm_is_drawn_from_its_links_with_joints_at_a_limit_marked(window: Window) -> None:
    seen = stopped_session(window)
    del seen.about["arm"], seen.about["trials"]
    assert seen.glance is not None
    angles = np.array([0.0, 0.0, np.pi / 2])
    seen.glance = replace(seen.glance, angles=tuple(angles.tolist()), speeds=(0.0,) * 3, torques=(0.0,) * 3)
    drawn = ElementTree.fromstring(robot_svg(seen))
    tip = tool_position(angles, "right")
    assert drawn.attrib["aria-label"].endswith(f"its tip is at {', '.join(f'{value:.2f}' for value in tip)} m")
    above, side = ([*map(float, line.attrib["points"].replace(",", " ").split())] for line in drawn.iter("polyline"))
    # Both views have one scale: what is as far to the right in one is so in the other.
    assert np.diff(above[::2]) == pytest.approx(np.diff(side[::2]), abs=0.2)
    assert Colour.BAD not in robot_svg(seen) and "Red:" not in arm_picture(seen)
    seen.glance = replace(seen.glance, speeds=(0.0, 1.4, 0.0))
    assert Colour.BAD in robot_svg(seen) and "Red: a joint at a limit." in arm_picture(seen)
    del seen.about["chain"]
    assert "links are not known" in arm_picture(seen)


@pytest.mark.parametrize("count", [2, 5])
def test_robots_of_any_number_of_joints_are_shown(window: Window, count: int) -> None:
    seen = stopped_session(window)
    seen.about["joints"] = (seen.about["joints"] * 2)[:count]
    assert seen.glance is not None
    assert joints(seen, seen.glance).count('scope="row"') == min(count, layout.JOINTS)
    assert ("2 more joints are not shown" in joints(seen, seen.glance)) == (count == 5)
    assert f"{seen.glance.missing} of {count * seen.glance.cycles} (" in timing(seen, seen.glance)


def test_the_rate_is_that_of_the_last_second_and_of_all_cycles_once_it_is_over() -> None:
    seen = Watched(SimpleNamespace(), {})  # type: ignore[arg-type]
    assert seen.rate_hz is None
    start = _glance((1,), 0.0)
    for second, cycles in enumerate((1, 101, 151)):
        glance = replace(start, time_ns=second * 1e9, cycles=cycles)
        seen.look = SimpleNamespace(look=lambda found=glance: found, path=Path("misfit-view-0-x"))  # type: ignore[assignment]
        seen.refresh()
        seen._lately = type(seen._lately)(seen._lately, maxlen=2)
        seen.life = Life.RUNNING
    assert seen.rate_hz == 50.0
    seen.life = Life.ENDED
    assert seen.rate_hz == 75.0


def test_a_session_without_a_recorded_trial_does_not_advise_to_compare(window: Window, tmp_path: Path) -> None:
    seen = stopped_session(window)
    seen.life = Life.KILLED
    seen.about["recording"] = str(tmp_path)
    assert "misfit compare" not in state(seen).more
    (tmp_path / "trial_01.parquet").touch()
    assert f"misfit compare arm {tmp_path}" in state(seen).more


def test_a_session_that_says_nothing_of_its_limits_is_shown_all_the_same() -> None:
    seen: Any = SimpleNamespace(about={})
    assert joints(seen, seen) == "<p>This session does not say what its limits are.</p>"


@pytest.mark.parametrize("stop", [None, SimpleNamespace(port=0)])
def test_a_session_without_its_stop_button_is_not_called_nothing_to_stop(stop: Any) -> None:
    running: Any = SimpleNamespace(is_over=False, stop=stop, title="hold (7)")
    said = stop_bar(running, "127.0.0.1")
    assert "nothing to stop" not in said
    assert "use the pendant, or Ctrl-C" in said
