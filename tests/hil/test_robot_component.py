"""A robot where an FMU was."""

import ast
import json
import re
import tempfile
import time
from collections.abc import Callable
from functools import wraps
from io import StringIO
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pyarrow.parquet as pq
import pytest
from rich.console import Console
from rich.progress import Progress

from fmus.errors import ComponentError, MisfitError
from hil.component import RobotComponent, open_robot
from hil.control.controllers import Asked, Observed
from hil.control.pilot import Decision, Pilot
from hil.record import replaced
from hil.session.loop import Summary, Wishes
from hil.session.recorded import replay_session
from hil.stop.flag import StopFlag
from hil.view.glance import Look
from hil.view.window import windows
from hil.virtual.process import virtual_robot
from orchestrator.cli.common import on_screen, screen_paused
from orchestrator.cosim.system import ComponentSpec

HIL = Path(__file__).parents[2] / "hil"


@pytest.fixture(autouse=True)
def _here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)  # where it records, unless told otherwise
    (tmp_path / "shared").mkdir()
    monkeypatch.setenv("MISFIT_SHARED", str(tmp_path / "shared"))  # sessions of other tests are not seen


def again_where_the_machine_stalled(test: Callable[..., None]) -> Callable[..., None]:
    """Run a test in real time up to four times: a machine that stands still for 100 ms ends a session, as it should."""

    @wraps(test)
    def patient(*arguments: Any, **options: Any) -> None:
        for _ in range(3):
            try:
                return test(*arguments, **options)
            except (ComponentError, AssertionError) as error:  # another message than the one expected, too
                if not re.search("on_time:|positions_answered:", str(error)):
                    raise
        test(*arguments, **options)

    return patient


def robot(**options: object):  # type: ignore[no-untyped-def]
    return open_robot(ComponentSpec("robot", "robot", isolate=False, options={"rate_hz": 100.0, **options}), Path())


@again_where_the_machine_stalled
def test_a_run_begins_where_the_arm_is_even_if_its_session_is_slow_to_tell(monkeypatch: pytest.MonkeyPatch) -> None:
    tell, component = RobotComponent._watch, robot(virtual=True)

    def slowly(self: RobotComponent, pilot: Pilot, decision: Decision) -> None:
        if pilot.is_armed:
            if decision.observed.seconds < 0:  # the cycle that arms it
                time.sleep(0.05)
            tell(self, pilot, decision)

    monkeypatch.setattr(RobotComponent, "_watch", slowly)
    component.initialise(0.0, None, None)
    try:
        component.start()
        assert component.get(["q3"]) == pytest.approx([2.84], abs=0.05)
    finally:
        component.terminate()


@again_where_the_machine_stalled
def test_a_torque_that_is_asked_for_turns_the_joint_its_way() -> None:
    component = robot(virtual=True)
    component.initialise(0.0, None, None)
    try:
        component.start()
        before, time = component.get(["q3"])[0], 0.0
        component.set(["asked3"], [-0.5])
        for _ in range(30):
            time = component.step(time, 0.01).time
        angle, speed, sent, reaction = component.get(["q3", "w3", "tau3", "reaction"])
    finally:
        component.terminate()
    assert time == pytest.approx(0.3)
    assert angle < before
    assert speed < 0
    assert -0.5 <= sent < 0
    assert reaction == 0


def test_what_the_safety_core_stops_ends_the_run_with_its_reason() -> None:
    component = robot(virtual=True)
    component.initialise(0.0, None, None)
    try:
        component.start()
        component.set(["asked1"], [float("nan")])
        with pytest.raises(ComponentError, match="the safety core stopped the robot: finite_command"):
            component.step(0.0, 0.5)
    finally:
        component.terminate()


@pytest.mark.parametrize("options", [{}, {"virtual": True, "speed": 3}])
def test_a_robot_that_is_neither_virtual_nor_at_a_bench_is_refused(options: dict) -> None:
    with pytest.raises(MisfitError, match="either virtual = true or source"):
        robot(**options)


def test_a_rate_that_is_no_number_is_refused_by_its_value() -> None:
    with pytest.raises(MisfitError, match="rate_hz = 'fast'; a number"):
        robot(virtual=True, rate_hz="fast")


def test_a_robot_that_was_not_started_up_does_not_step() -> None:
    with pytest.raises(ComponentError, match="has not been started up"):
        robot(virtual=True).step(0.0, 0.01)


@again_where_the_machine_stalled
def test_a_run_is_recorded_as_a_session_and_replays(tmp_path: Path) -> None:
    folder = Path(tempfile.mkdtemp(dir=tmp_path)) / "run"
    component = robot(virtual=True, record=str(folder))
    component.initialise(0.0, None, None)
    try:
        component.start()
        time = 0.0
        for k in range(20):
            component.set(["asked3"], [-0.02 * k])
            time = component.step(time, 0.01).time
    finally:
        component.terminate()
    found = replay_session(folder)
    assert found.cycles > 20 and found.first_different is None
    table = pq.read_table(folder / "signals.parquet")
    assert -0.38 <= table["asked3"].to_numpy().min() <= -0.3
    assert (folder / "case.toml").exists()


@again_where_the_machine_stalled
def test_the_stop_button_lets_the_arm_of_a_run_down() -> None:
    component = robot(virtual=True)
    component.initialise(0.0, None, None)
    try:
        component.start()
        [window] = windows()
        StopFlag(Path(Look(window).about["stop"])).press()
        with pytest.raises(ComponentError, match="not_aborted: stopped by the operator"):
            for k in range(300):
                component.step(0.01 * k, 0.01)
    finally:
        component.terminate()


@pytest.mark.parametrize("ends", ["by itself", "by an error"])
def test_a_run_whose_session_is_over_does_not_go_on_with_what_the_robot_said_last(ends: str) -> None:
    component = robot(virtual=True)
    component._opened = SimpleNamespace(
        wishes=lambda seconds: lambda: Wishes(),
        refuse_slow=lambda: None,
        loop=SimpleNamespace(run=lambda wishes: None if ends == "by itself" else 1 / 0, summary=Summary()),
        result=lambda refused: {},
    )
    component._cycle(component._opened)
    with pytest.raises(ComponentError, match="has ended|session failed: ZeroDivisionError"):
        component.step(0.0, 0.01)


STILL = (0.0, 0.0, 0.0)


def test_a_run_that_falls_silent_asks_for_nothing_and_begins_again_at_the_foot_of_the_ramp() -> None:
    asked, seen = Asked(), Observed(1.0, STILL, STILL, STILL)
    assert asked.torque(replaced(seen, asked=(1.0, 0.0, 0.0))) == (1.0, 0.0, 0.0)
    turn = asked.turn
    assert asked.torque(seen) == (0.0, 0.0, 0.0)
    asked.torque(replaced(seen, asked=(1.0, 0.0, 0.0)))
    assert asked.turn == turn + 1


def test_limits_looser_than_those_of_the_safety_module_are_refused_to_a_run_as_to_a_session(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    with virtual_robot() as bus:
        (tmp_path / "bench.toml").write_text(
            "[bus]\n" + "".join(f"{key} = {json.dumps(value)}\n" for key, value in bus.items())
            + "[[joints]]\ntorque = 60.0\n"
        )  # fmt: skip
        component = open_robot(ComponentSpec("robot", "robot", source="bench.toml", isolate=False), tmp_path)
        assert isinstance(component, RobotComponent)
        monkeypatch.setattr(
            "hil.component.ask_home", lambda: True
        )  # the limits are looked at before anybody is asked to arm
        with pytest.raises(MisfitError, match=r"lower `torque` of \[\[joints\]\]"):
            component.initialise(0.0, None, None)
        component.terminate()


def test_torque_has_one_entry() -> None:
    """Read from the source: who starts robots, cycles loops and runs watchdogs."""
    callers: dict[str, set[str]] = {"Loop": set(), "start_up": set(), "watchdog": set()}
    for path in HIL.rglob("*.py"):
        for node in ast.walk(ast.parse(path.read_text())):
            called = getattr(node.func, "id", getattr(node.func, "attr", "")) if isinstance(node, ast.Call) else ""
            if called in callers:
                callers[called].add(str(path.relative_to(HIL)))
    # A Proficio stands behind the contract by handing its start on.
    assert callers.pop("start_up") == {"session/entry.py", "barrett/kind.py"}
    assert callers == {name: {"session/entry.py"} for name in callers}


def test_a_question_is_asked_while_nothing_else_draws_on_the_terminal() -> None:
    bar = Progress(console=Console(file=StringIO(), force_terminal=True))
    with on_screen(bar):
        assert bar.live.is_started
        with screen_paused():
            assert not bar.live.is_started
        assert bar.live.is_started
