"""What is left of a session that did not end as it should: its files are made all the same."""

import json
import os
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import pytest

from fmus.errors import ComponentError, MisfitError
from hil.control.pilot import Decision, Pilot
from hil.session import session
from hil.session.entry import Operator
from hil.session.recorded import finish_session, replay_session
from hil.session.session import run_session
from hil.settings import Settings, default_settings, virtual_settings
from hil.virtual.direct_bus import DirectBus
from hil.virtual.made import Made
from orchestrator.measurements import load_measurements


@pytest.fixture
def robot() -> Iterator[tuple[subprocess.Popen[str], Settings]]:
    command = [sys.executable, "-m", "hil.virtual"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True, start_new_session=True) as process:
        assert process.stdout is not None
        bus = {
            "interface": "socketcand",
            "host": "127.0.0.1",
            "port": int(process.stdout.readline()),
            "channel": "can0",
        }
        # A machine that is busy answers late, and a session bears it here: only what is broken shall end it.
        settings = default_settings(rate_hz=50.0)
        patient = replace(
            settings.limits, missing_comply_s=20.0, missing_release_s=21.0, late_comply_s=20.0, stall_s=20.0
        )
        yield process, replace(settings, bus=bus, gravity=False, limits=patient)
        process.kill()


def operator_that(does: dict[int, object]) -> Operator:
    """One who does something after so many decisions."""
    count = 0

    def watch(pilot: Pilot, decision: Decision) -> None:
        nonlocal count
        count += 1
        if count in does:
            does[count]()  # type: ignore[operator]

    return Operator(lambda: True, lambda robot: True, watch=watch)


def test_what_was_recorded_until_the_bus_broke_is_a_measurement_set_that_replays(
    robot: tuple[subprocess.Popen[str], Settings], tmp_path: Path
) -> None:
    process, settings = robot
    folder = tmp_path / "session"

    with pytest.raises(ComponentError, match="what was recorded until then is in") as caught:
        run_session(settings, 600, operator_that({60: process.kill}), folder)

    assert "\n" not in str(caught.value)
    assert replay_session(folder).cycles >= 60
    assert len(load_measurements(folder).trials) > 0
    assert json.loads((folder / "summary.json").read_text())["faults"][0] in str(caught.value)


def test_a_second_ctrl_c_while_files_are_written_lets_them_be_finished(
    robot: tuple[subprocess.Popen[str], Settings],
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capfd: pytest.CaptureFixture[str],
) -> None:
    _, settings = robot
    finish = session.finish_session

    def interrupted(folder: Path, summary: dict) -> None:
        os.kill(os.getpid(), signal.SIGINT)
        finish(folder, summary)
        os.kill(os.getpid(), signal.SIGINT)

    monkeypatch.setattr(session, "finish_session", interrupted)
    stop = {40: lambda: os.kill(os.getpid(), signal.SIGINT)}

    document = run_session(settings, 600, operator_that(stop), tmp_path / "session")

    assert document["faults"] == ["not_aborted: stopped by the operator"]
    assert (tmp_path / "session" / "frames.blf").exists()
    assert "the recording written" in capfd.readouterr().err
    assert signal.getsignal(signal.SIGINT) is signal.default_int_handler


def test_a_session_that_was_cut_off_is_finished_later_and_becomes_a_measurement_set(
    robot: tuple[subprocess.Popen[str], Settings], tmp_path: Path
) -> None:
    _, settings = robot
    folder = tmp_path / "session"
    run_session(settings, 1.0, operator_that({}), folder)
    whole = (folder / "signals.parquet").read_bytes()
    for made in ("signals.parquet", "case.toml", "frames.blf", "summary.json"):
        (folder / made).unlink()
    with (folder / "frames.bin").open("ab") as file:
        file.write(b"\x01\x02\x03")  # a record that did not come to its end

    finish_session(folder)

    assert len((folder / "signals.parquet").read_bytes()) == pytest.approx(len(whole), rel=0.1)
    assert len(load_measurements(folder).trials) > 0


def test_a_folder_without_a_recording_cannot_be_finished(tmp_path: Path) -> None:
    with pytest.raises(MisfitError, match="holds no cycles to replay: settings.json is missing"):
        finish_session(tmp_path)


def test_a_session_in_virtual_time_does_not_notice_that_its_machine_stood_still(tmp_path: Path) -> None:
    """In real time 100 ms without a position end it; here 300 ms pass in which nothing of the session happens."""
    stands_still = operator_that({20: lambda: time.sleep(0.3)})
    inside = DirectBus(Made().made())
    document = run_session(virtual_settings(rate_hz=100.0), 0.5, stands_still, tmp_path / "session", inside=inside)
    assert document["faults"] == []
    assert (document["missed"], document["answers_late"], document["largest_gap_ms"]["cycles"]) == (0, 0, 10.0)
    assert replay_session(tmp_path / "session").first_different is None
