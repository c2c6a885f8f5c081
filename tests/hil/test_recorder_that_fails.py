"""A recorder that is killed or stands still: the session notices, and nothing that was to be recorded is lost."""

import os
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import pytest

from fmus.errors import ComponentError
from hil.codecs.frame import Frame, Timed
from hil.recording import recorder as module
from hil.recording.recorder import FRAMES, SILENT_NS, Recorder
from hil.recording.replay import read_records
from hil.session.loop import Loop, Wishes
from tests.hil.bench import Bench, ExactTimer

PATIENCE_S = 60.0


class Clock:
    """A time (ns) that only a test moves."""

    ns = 1

    def __call__(self) -> int:
        return self.ns


@pytest.fixture
def clock() -> Clock:
    return Clock()


@pytest.fixture
def recorder(tmp_path: Path, clock: Clock, monkeypatch: pytest.MonkeyPatch) -> Iterator[Recorder]:
    monkeypatch.setattr(module, "IMPATIENCE_S", 0.05)
    found = Recorder(tmp_path / "session", clock)
    yield found
    if found._process.poll() is None:
        found._process.kill()
        found._process.wait()


def put(recorder: Recorder, first: int, last: int) -> None:
    for k in range(first, last):
        recorder.frame(Timed(k, Frame(k % 2000, k.to_bytes(4, "little"))), sent=False)


def wait_until_written(recorder: Recorder) -> None:
    deadline = time.monotonic() + PATIENCE_S
    while not recorder.ring.is_empty and time.monotonic() < deadline:
        time.sleep(0.001)
    assert recorder.ring.is_empty


def recorded(recorder: Recorder) -> list[int]:
    return [timed.time_ns for _, _, timed in read_records(recorder.folder)]


@pytest.mark.parametrize("number", [signal.SIGSTOP, signal.SIGKILL])
def test_what_a_recorder_that_fails_has_not_written_is_written_all_the_same(
    recorder: Recorder, clock: Clock, number: int
) -> None:
    put(recorder, 0, 500)
    wait_until_written(recorder)
    os.kill(recorder._process.pid, number)
    if number == signal.SIGKILL:
        recorder._process.wait()
    put(recorder, 500, 1500)
    assert recorder.keeps_up() == (number == signal.SIGSTOP)
    clock.ns += SILENT_NS + 1
    assert not recorder.keeps_up()
    assert recorder.trouble == (
        "the recorder has stood still for 3 s"
        if number == signal.SIGSTOP
        else "the recorder has ended; the disk may be full"
    )
    recorder.finish()
    assert recorded(recorder) == list(range(1500))
    assert not recorder.ring.path.exists()


def test_a_recorder_that_died_while_it_wrote_leaves_no_record_cut_off_and_none_twice(recorder: Recorder) -> None:
    os.kill(recorder._process.pid, signal.SIGSTOP)
    put(recorder, 0, 40)
    data = recorder.ring.waiting()
    (recorder.folder / FRAMES).write_bytes(module.MAGIC + data[: 24 * 7 + 5])
    recorder._process.kill()
    recorder.finish()
    assert recorded(recorder) == list(range(40))


def test_a_recorder_that_rests_because_nothing_happens_is_well(recorder: Recorder, clock: Clock) -> None:
    put(recorder, 0, 10)
    wait_until_written(recorder)
    assert recorder.keeps_up()
    clock.ns += 100 * SILENT_NS
    assert recorder.keeps_up()
    recorder.finish()


def test_a_session_in_virtual_time_does_not_outrun_the_recorder(recorder: Recorder, clock: Clock) -> None:
    # Six seconds of the session pass, and next to none of the recorder's: its process has no turn meanwhile.
    bench = Bench()
    os.kill(recorder._process.pid, signal.SIGSTOP)
    bench.wire.tap = recorder.frame
    pilot, began = bench.pilot(), bench.bus.time_ns

    def wishes() -> Wishes:
        clock.ns += 1
        return Wishes(arm=not pilot.is_armed, over=bench.bus.time_ns - began > 2 * SILENT_NS)

    summary = Loop(bench.wire, pilot, ExactTimer(bench), recorder).run(wishes)
    os.kill(recorder._process.pid, signal.SIGCONT)
    recorder.finish()
    bench.wire.close()
    assert summary.faults == []


def test_records_that_cannot_be_written_at_all_are_said_to_be_lost(
    recorder: Recorder, monkeypatch: pytest.MonkeyPatch
) -> None:
    recorder._process.kill()
    recorder._process.wait()
    (recorder.folder / FRAMES).unlink()
    (recorder.folder / FRAMES).mkdir()
    with pytest.raises(ComponentError, match=r"records were lost: frames\.bin cannot be written"):
        recorder.finish()


def test_the_recorders_process_begins_without_libraries_of_buses_and_numbers() -> None:
    # What it loads counts as silence.
    heavy = {"can", "pandas", "numpy", "scipy"}
    program = f"import sys, hil.recording.writer; print(*sorted({heavy!r} & set(sys.modules)))"
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True)
    assert done.stdout.split() == []
