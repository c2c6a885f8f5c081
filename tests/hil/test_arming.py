"""Nobody takes a virtual session for a real one, or the reverse: which robot is said, and a real one is armed by a typed word."""

import contextlib
import io
import os
import threading
from pathlib import Path
from types import SimpleNamespace

import pytest
from click.testing import CliRunner

from fmus.errors import MisfitError
from hil import terminal
from hil.barrett.start_up import Robot
from hil.cli import hil
from hil.safety.cycle import Reaction, Trip
from hil.session import entry
from hil.session.entry import Opened, Operator
from hil.terminal import ask_arm, ask_home
from hil.trials_cli import LISTENER, _operator
from tests.hil.bench import SETTINGS, Bench

ROBOT = Robot("right", (4096, 4096, 4096), (2700, 2700, 2700), {}, None, None)
BUS = {"interface": "virtual", "channel": "nowhere"}


class Terminal:
    """Standard input in front of which somebody sits, or nobody."""

    def __init__(self, present: bool) -> None:
        self.present = present

    def isatty(self) -> bool:
        return self.present

    def fileno(self) -> int:
        raise io.UnsupportedOperation


@pytest.fixture
def somebody(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(terminal.sys, "stdin", Terminal(True))


@pytest.mark.parametrize(
    ("typed", "armed"), [("ARM", True), ("arm", False), ("y", False), ("", False), ("ARM!", False)]
)
def test_only_the_typed_word_arms_a_real_robot(
    typed: str, armed: bool, somebody: None, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(terminal.click, "prompt", lambda *_, **__: typed)
    assert ask_arm(ROBOT) is armed


def test_a_word_that_was_typed_before_the_question_does_not_arm(monkeypatch: pytest.MonkeyPatch) -> None:
    keyboard, line = os.openpty()
    os.write(keyboard, b"ARM\n")

    def prompt(*_: object, **__: object) -> str:
        os.write(keyboard, b"no\n")
        return terminal.sys.stdin.readline().strip()

    with os.fdopen(line) as stdin:
        monkeypatch.setattr(terminal.sys, "stdin", stdin)
        monkeypatch.setattr(terminal.click, "prompt", prompt)
        assert ask_arm(ROBOT) is False
    os.close(keyboard)


def test_without_a_terminal_a_real_robot_is_neither_armed_nor_zeroed(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(terminal.sys, "stdin", Terminal(False))
    with pytest.raises(MisfitError, match="arming needs somebody at a terminal"):
        ask_arm(ROBOT)
    with pytest.raises(MisfitError, match="has not been zeroed; .* needs somebody at a terminal"):
        ask_home()


@pytest.mark.parametrize("command", [["hold"], ["check"], ["record", "study", "--out", "x"]])
@pytest.mark.parametrize("both", [True, False])
def test_which_robot_is_meant_has_to_be_said_and_cannot_be_both(
    command: list[str], both: bool, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    bench = tmp_path / "bench.toml"
    bench.write_text('[bus]\ninterface = "virtual"\nchannel = "nowhere"\n')
    robots = ["--virtual", "--bench", str(bench)] if both else []
    result = CliRunner().invoke(hil, [*command, *robots])
    assert isinstance(result.exception, MisfitError)
    assert "say either --virtual or --bench FILE" in str(result.exception)
    assert list(tmp_path.iterdir()) == [bench], "a session that never began leaves no folder"


def test_what_is_asked_before_arming_names_the_robot(
    somebody: None, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    asked = []
    monkeypatch.setattr(terminal.click, "prompt", lambda text, **_: asked.append(text) or "")
    ask_arm(ROBOT)
    assert asked == ["A real Proficio, mounted on the right, is on this bus. Type ARM to switch its torques on"]


def test_what_answers_the_question_before_arming_is_not_taken_for_a_confirmation(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    keyboard, line = os.openpty()

    def prompt(*_: object, **__: object) -> str:
        os.write(keyboard, b"ARM\n")
        return terminal.sys.stdin.readline().strip()

    with os.fdopen(line) as stdin, contextlib.ExitStack() as stack:
        monkeypatch.setattr(terminal.sys, "stdin", stdin)
        monkeypatch.setattr(terminal.click, "prompt", prompt)
        operator = _operator(None, True, BUS, True, stack)
        assert operator.may_arm(ROBOT) is True
        assert not operator.confirm.is_set()
        os.write(keyboard, b"\n")
        assert operator.confirm.wait(60)
        os.write(keyboard, b"\x04")  # the end, for the listener
        for thread in threading.enumerate():
            if thread.name == LISTENER:
                thread.join(60)
    os.close(keyboard)


def test_the_trials_of_a_real_robot_ask_the_same_people() -> None:
    with contextlib.ExitStack() as stack:
        operator = _operator(None, False, True, True, stack)
        assert (operator.at_home, operator.may_arm) == (ask_home, ask_arm)


def test_an_arm_that_only_the_pendant_keeps_from_being_armed_is_not_said_to_be_refused_by_anything_else() -> None:
    bench = Bench(eager=False)
    pilot = bench.pilot()
    bench.run(pilot, 40)  # in the first cycle the module has not answered, in the last one the session has ended
    assert not pilot.is_armed
    assert pilot.refused is None


@pytest.mark.parametrize(
    ("refused", "words"),
    [
        (None, "press Activate on the pendant"),
        (
            Trip("watched", Reaction.RELEASE, "the watchdog has fallen silent"),
            "watched: the watchdog has fallen silent",
        ),
        (
            Trip("module_agrees", Reaction.RELEASE, "the safety module found a limit passed: heartbeat"),
            "module_agrees: the safety module found a limit passed: heartbeat; press Activate on the pendant",
        ),
    ],
)
def test_what_an_arm_waits_for_is_said_once_and_a_watchdog_that_is_gone_is_not_waited_for(
    refused: Trip | None, words: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(entry, "MOMENT_S", -1.0)
    told, heartbeat = list[str](), SimpleNamespace(is_watched=True)
    pilot = SimpleNamespace(is_armed=False, refused=refused, controller=None, told=str)
    operator = Operator(lambda: True, lambda robot: True, tell=told.append)
    loop, stop = (
        SimpleNamespace(heartbeat=heartbeat, wire=SimpleNamespace(now=lambda: 0)),
        SimpleNamespace(is_pressed=False),
    )
    wishes = Opened(SETTINGS, pilot, loop, None, None, True, operator, stop).wishes(1.0)  # type: ignore[arg-type]
    assert [wishes().over for _ in range(3)] == [False] * 3
    assert len(told) == 1 and told[0].startswith(f"waiting to arm: {words}")
    heartbeat.is_watched = False
    assert wishes().over
