"""The live view: a session's window in shared memory, and the picture that is drawn of it."""

import io
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from rich.console import Console

from fmus.errors import MisfitError
from hil.codecs.barrett.safety_module import Button
from hil.session.loop import Loop, Wishes
from hil.view.glance import Glance, Look
from hil.view.layout import EDGES
from hil.view.live import picture, watch
from hil.view.window import Window, newest
from tests.hil.bench import Bench, ExactTimer


def shown(bench: Bench, cycles: int, estop_at: int = 0) -> Glance:
    """The last look at a session of so many cycles."""
    window = Window.create(bench.settings.limits.period_ns)
    assert Look(window.path).look() is None
    pilot, count = bench.pilot(), 0

    def wishes() -> Wishes:
        nonlocal count
        count += 1
        if count == estop_at:
            bench.robot.safety.press(Button.ESTOP, bench.bus.time_ns)
        return Wishes(arm=not pilot.is_armed and count < 50, over=count > cycles)

    try:
        Loop(bench.wire, pilot, ExactTimer(bench), window=window).run(wishes)
        glance = Look(window.path).look()
        assert glance is not None
        return glance
    finally:
        window.remove()


def drawn(glance: Glance) -> str:
    console = Console(file=io.StringIO(), width=100)
    console.print(picture(glance, 498.0))
    assert isinstance(console.file, io.StringIO)
    return console.file.getvalue()


def test_a_window_shows_the_last_cycle_and_counts_all_of_them() -> None:
    bench = Bench()
    glance = shown(bench, 300)
    assert glance.angles == pytest.approx(bench.plant.angles, abs=1e-3)
    assert glance.lateness[0] == sum(glance.lateness) == glance.cycles  # virtual time is never late
    assert glance.period_ns == 2_000_000


def test_the_picture_says_what_the_core_does_and_why_it_stopped() -> None:
    text = drawn(shown(Bench(), 300, estop_at=200))
    assert "stopped, silence" in text
    assert "module_agrees: emergency stop" in text
    assert "498 Hz of 500" in text


def test_lateness_falls_into_its_class() -> None:
    bench = Bench()
    window, pilot = Window.create(1), bench.pilot()
    Loop(bench.wire, pilot, ExactTimer(bench)).run(lambda: Wishes(over=True))
    loop = Loop(bench.wire, pilot, ExactTimer(bench), window=window)
    for late_us in (0.0, 29.0, 31.0, 1e6):
        loop._late_ns = int(late_us * 1e3)
        loop._cycle(Wishes())
    glance = Look(window.path).look()
    window.remove()
    assert glance is not None
    found = {edge: count for edge, count in zip((*EDGES, np.inf), glance.lateness, strict=True) if count}
    assert found == {1.0: 1, 30.0: 1, 40.0: 1, np.inf: 1}
    assert (glance.late_us(0.5), glance.late_us(0.75), glance.late_us(1.0)) == (30.0, 40.0, 1e6)


WRITER = """
import sys
from pathlib import Path
from types import SimpleNamespace as Some
from hil.view.window import Window
window = Window(Path(sys.argv[1]), 1)
for k in range(20000):
    v = (float(k),) * 3
    trip = Some(rule='calm', reaction=0, words=str(k))
    outcome = Some(torques=v, reaction=0, trips=(trip,))
    window.put(k + 1, 0, k, Some(stopped=None, is_armed=True, cycle=k, missing_answers=k, refused=None),
               Some(outcome=outcome, observed=Some(q=v, w=v, f=v), asked=v, shown=v))
"""


def test_a_look_never_mixes_two_cycles() -> None:
    window, looks = Window.create(2_000_000), 0
    look = Look(window.path)
    with subprocess.Popen([sys.executable, "-c", WRITER, str(window.path)]) as writer:
        while writer.poll() is None:
            glance = look.look()
            if glance is not None:
                looks += 1
                values = {
                    glance.cycles,
                    glance.missed,
                    int(glance.broken[0].words),
                    *glance.shown[:3],
                    *glance.angles,
                    *glance.torques,
                    *glance.asked,
                    *glance.force,
                }
                assert len(values) == 1
    window.remove()
    assert writer.returncode == 0
    assert looks > 10


def test_a_view_ends_with_its_session(tmp_path: Path) -> None:
    console = Console(file=io.StringIO(), width=100)
    bench = Bench()
    window, pilot = Window.create(2_000_000), bench.pilot()
    Loop(bench.wire, pilot, ExactTimer(bench), window=window).run(lambda: Wishes(over=True))
    assert watch(window.path, console, seconds=0.3) == 1
    window.remove()
    with pytest.raises(MisfitError, match="shows no session"):
        watch(window.path, console)
    assert np.isfinite(bench.plant.angles).all()


def test_the_window_of_a_killed_session_is_cleared_away(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("MISFIT_SHARED", str(tmp_path))  # sessions of other tests are no news here
    code = "from hil.view.window import Window; print(Window.create(1).path)"
    left = Path(subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout.strip())
    assert left.exists()
    mine = Window.create(2_000_000)
    assert not left.exists()
    assert newest() == mine.path
    mine.remove()
