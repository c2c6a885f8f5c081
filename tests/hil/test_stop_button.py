"""The stop button: it stops the robot for those who know its address, and for nobody else; without it nothing changes."""

import http.client
import json
import socket
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import pytest

from fmus.errors import MisfitError
from hil.recording.records import Flag, Kind
from hil.recording.replay import read_records
from hil.session.recorded import replay_session
from hil.stop.flag import StopFlag
from hil.stop.server import stop_button, words_of
from tests.hil.held import PATIENCE_S, end_by


@pytest.fixture
def flag() -> Iterator[StopFlag]:
    with stop_button() as found:
        wait_until(lambda: found.port != 0)
        yield found


@pytest.fixture(scope="module")
def unpressed() -> Iterator[StopFlag]:
    """One for all tests that must not press it."""
    with stop_button() as found:
        wait_until(lambda: found.port != 0)
        yield found


def wait_until(condition: object) -> None:
    deadline = time.monotonic() + PATIENCE_S
    while not condition() and time.monotonic() < deadline:  # type: ignore[operator]
        time.sleep(0.01)
    assert condition()  # type: ignore[operator]


def ask(flag: StopFlag, method: str, path: str, host: str = "127.0.0.1", **headers: str) -> tuple[int, str]:
    connection = http.client.HTTPConnection(host, flag.port, timeout=5)
    connection.request(method, path, headers={name.replace("_", "-"): value for name, value in headers.items()})
    answer = connection.getresponse()
    text = answer.read().decode()
    connection.close()
    return answer.status, text


def test_a_post_with_the_token_presses_the_button_and_the_page_says_so(flag: StopFlag) -> None:
    status, text = ask(flag, "GET", f"/{flag.token}/")
    assert status == 200 and "STOP" in text and not flag.is_pressed
    assert ask(flag, "POST", f"/{flag.token}/stop", Origin=f"http://127.0.0.1:{flag.port}")[0] == 303
    assert flag.is_pressed
    assert json.loads(ask(flag, "GET", f"/{flag.token}/state")[1])["words"] == "Pressed."


REFUSED = {
    "no token": ("POST", "/stop", {}, 403),
    "a wrong token": ("POST", f"/{'x' * 43}/stop", {}, 403),
    "a token that is no text": ("POST", "/%FF%00/stop", {}, 403),
    "a foreign page": ("POST", "/TOKEN/stop", {"Origin": "https://example.org"}, 403),
    "a page without an origin": ("POST", "/TOKEN/stop", {"Origin": "null"}, 403),
    "another port of this machine": ("POST", "/TOKEN/stop", {"Origin": "http://127.0.0.1:1"}, 403),
    "a foreign name for this machine": ("POST", "/TOKEN/stop", {"Host": "example.org"}, 403),
    "a link": ("GET", "/TOKEN/stop", {}, 404),
    "an order to arm": ("POST", "/TOKEN/arm", {}, 404),
    "an order to move": ("POST", "/TOKEN/torque", {}, 404),
    "a put": ("PUT", "/TOKEN/stop", {}, 501),
    "a delete": ("DELETE", "/TOKEN/stop", {}, 501),
    "an option": ("OPTIONS", "/TOKEN/stop", {}, 501),
}


@pytest.mark.parametrize("case", REFUSED, ids=str)
def test_everything_but_the_press_of_one_who_knows_the_token_is_refused(unpressed: StopFlag, case: str) -> None:
    method, path, headers, status = REFUSED[case]
    assert ask(unpressed, method, path.replace("TOKEN", unpressed.token), **headers)[0] == status
    assert not unpressed.is_pressed


def test_the_button_listens_on_this_machine_only(unpressed: StopFlag) -> None:
    listening = {local for local, port in _listening() if port == unpressed.port}
    assert listening <= {"0100007F", "00000000000000000000000001000000"}
    assert "0100007F" in listening


def _listening() -> list[tuple[str, int]]:
    found = []
    for table in ("/proc/net/tcp", "/proc/net/tcp6"):
        for line in Path(table).read_text().splitlines()[1:] if Path(table).exists() else []:
            local, state = line.split()[1], line.split()[3]
            if state == "0A":
                address, port = local.split(":")
                found.append((address, int(port, 16)))
    return found


def test_clients_that_connect_and_say_nothing_do_not_hold_the_button_up(flag: StopFlag) -> None:
    began = time.monotonic()
    silent = [socket.create_connection(("127.0.0.1", flag.port)) for _ in range(20)]
    assert ask(flag, "POST", f"/{flag.token}/stop")[0] == 303
    # Each of them is waited for five seconds, and who finds no room in the queue comes again after one.
    assert time.monotonic() - began < 1.0
    for each in silent:
        each.close()


def test_the_flag_is_for_this_user_alone_and_a_reader_cannot_press(unpressed: StopFlag) -> None:
    assert unpressed.path.stat().st_mode & 0o077 == 0
    reader = StopFlag(unpressed.path, read_only=True)
    assert reader.token == unpressed.token and len(reader.token) >= 43
    with pytest.raises(TypeError):
        reader.press()
    reader.close()
    with pytest.raises(MisfitError, match="is no stop button"):
        StopFlag(Path("/nonexistent"))


def test_words_say_what_has_become_of_a_press() -> None:
    flag = StopFlag.create()
    assert "also when the page hangs" in words_of(flag)[0]
    flag.press()
    flag._numbers[0] -= 600_000_000
    assert words_of(flag) == ("Pressed, but the loop does not answer. Use the pendant on the robot.", True)
    flag.saw()
    assert words_of(flag)[0].startswith("Stopping: the loop saw it after 600.")
    flag.finish()
    assert words_of(flag) == ("The session has ended, the arm has been let go.", False)
    flag.remove()


def test_the_server_ends_with_a_session_that_was_killed() -> None:
    code = "import time\nfrom hil.stop.server import stop_button\nwith stop_button() as f:\n print(f.path, flush=True)\n time.sleep(60)"
    with subprocess.Popen([sys.executable, "-c", code], stdout=subprocess.PIPE, text=True) as session:
        assert session.stdout is not None
        path = Path(session.stdout.readline().strip())
        found = StopFlag(path, read_only=True)
        wait_until(lambda: found.port != 0)
        session.kill()
    wait_until(lambda: not path.exists())
    with pytest.raises(OSError):
        ask(found, "GET", "/")
    found.close()


def flag_of(process: subprocess.Popen[str]) -> StopFlag:
    """The button of a session."""
    found: list[Path] = []

    def there() -> bool:
        found[:] = Path("/dev/shm").glob(f"misfit-stop-{process.pid}-*")
        return bool(found) and StopFlag(found[0], read_only=True).port != 0

    wait_until(there)
    return StopFlag(found[0], read_only=True)


needs_shared_memory = pytest.mark.skipif(not Path("/dev/shm").is_dir(), reason="no /dev/shm")


@needs_shared_memory
def test_a_press_lets_the_arm_down_within_a_second_of_cycles_and_leaves_a_whole_recording(tmp_path: Path) -> None:
    pressed_ns, status = 0, 0

    def press(process: "subprocess.Popen[str]", _: Path) -> None:
        nonlocal pressed_ns, status
        button = flag_of(process)
        pressed_ns = time.monotonic_ns()
        status = ask(button, "POST", f"/{button.token}/stop")[0]

    ended = end_by(tmp_path, press, "not_aborted")
    assert status == 303 and ended.code == 1, ended.errors
    assert ended.faults == ["not_aborted: stopped by the operator"]
    cycles = [record for record in read_records(ended.folder) if record.kind is Kind.CYCLE]
    told = [record.timed.time_ns for record in cycles if record.flags & Flag.ABORT]
    assert (told[0] - pressed_ns) * 1e-9 < 1.0  # 0.01 s on a calm machine
    assert 100 <= len(told) <= 103  # it fades over a second of 100 cycles, then the arm is let go
    assert replay_session(ended.folder).first_different is None


def test_the_flag_of_a_killed_session_is_cleared_away() -> None:
    code = "from hil.stop.flag import StopFlag; print(StopFlag.create().path)"
    left = Path(subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout.strip())
    assert left.exists()
    StopFlag.create().remove()
    assert not left.exists()
