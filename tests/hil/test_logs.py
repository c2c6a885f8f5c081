"""A log of any robot's bus becomes a measurement set: values, times and units are those that the database says."""

from pathlib import Path

import can
import numpy as np
import pytest
from click.testing import CliRunner

from fmus.errors import MisfitError
from hil.cli import hil
from hil.codecs.database import JOINT_ARM, Database
from hil.codecs.frame import Frame
from hil.logs import measurement_of_log
from orchestrator.measurements import load_measurements

ARM = Database(JOINT_ARM)
PERIOD = 0.004
COUNT = 60


def angles(k: int) -> np.ndarray:
    return np.round(np.sin(0.1 * np.arange(COUNT) + k), 6)


def joint(number: int, position: float) -> Frame:
    return ARM.encode(
        f"Joint{number}", {"Position": position, "Speed": 0.0, "Torque": 0.5 * number, "Counter": 0, "Valid": 1}
    )


@pytest.fixture(params=[".log", ".blf", ".asc", ".mf4"])
def log(request: pytest.FixtureRequest, tmp_path: Path) -> Path:
    """Three joints in turn, a slower force, and a stranger on the bus."""
    path = tmp_path / f"drive{request.param}"
    with can.Logger(str(path)) as writer:
        for k in range(COUNT):
            frames = [(0.0, joint(number, float(angles(number)[k]))) for number in (1, 2, 3)]
            if k % 10 == 5:
                force = {"ForceX": 0.01 * k, "ForceY": -1.0, "ForceZ": 0.0, "Counter": 0, "Saturated": 0}
                frames.append((0.001, ARM.encode("WristForce", force)))
            frames.append((0.002, Frame(0x7A0, b"\x01")))
            for later, frame in frames:
                at = 1.7e9 + k * PERIOD + later
                writer.on_message_received(
                    can.Message(timestamp=at, arbitration_id=frame.identifier, data=frame.data, is_extended_id=False)
                )
    return path


def test_values_times_and_units_of_a_log_come_back(log: Path, tmp_path: Path) -> None:
    found = measurement_of_log(log, ARM, tmp_path / "set")

    trials = load_measurements(tmp_path / "set").trials  # what is learned from, and the rest
    time, first = np.unique(np.concatenate([trial.time for trial in trials]), return_index=True)
    column = {name: np.concatenate([trial.columns[name] for trial in trials])[first] for name in trials[0].columns}
    kept = slice(6, None)  # from the first frame after every signal was there
    assert (found.at, found.rows, found.others) == ("Joint1", COUNT - 6, {0x7A0: COUNT})
    assert time == pytest.approx(np.arange(COUNT - 6) * PERIOD, abs=2e-6)
    assert column["Joint1.Position"] == pytest.approx(angles(1)[kept], abs=1e-9)
    # Of the other joints the frame before counts, which came just after the row's.
    assert column["Joint2.Position"] == pytest.approx(angles(2)[5:-1], abs=1e-9)
    assert column["WristForce.ForceX"][0] == pytest.approx(0.05)
    units = trials[0].units
    assert (units["Joint1.Position"], units["Joint3.Torque"], units["WristForce.ForceY"]) == ("rad", "N.m", "N")


@pytest.mark.parametrize("log", [".log"], indirect=True)
def test_rows_are_those_of_the_message_that_is_named(log: Path, tmp_path: Path) -> None:
    assert measurement_of_log(log, ARM, tmp_path / "set", at="WristForce").rows == COUNT // 10
    with pytest.raises(MisfitError, match="holds no message ArmState; there are Joint1, Joint2"):
        measurement_of_log(log, ARM, tmp_path / "set", at="ArmState")


@pytest.mark.parametrize("log", [".log"], indirect=True)
def test_a_unit_that_is_not_known_is_told_and_left_out(log: Path, tmp_path: Path) -> None:
    path = tmp_path / "odd.dbc"
    path.write_text('VERSION ""\nBU_: A\nBO_ 272 Lever: 8 A\n SG_ Way : 0|24@1- (1,0) [0|0] "furlong" A\n')
    found = measurement_of_log(log, Database(path), tmp_path / "set")
    assert (found.columns, found.units) == (("Lever.Way",), ("Lever.Way (furlong)",))


@pytest.mark.parametrize(
    ("name", "content", "words"),
    [
        ("a.txt", b"", "logs are read as .asc, .blf"),
        ("a.blf", b"no log at all", "is no log of CAN frames"),
        ("a.log", b"nonsense\n", "a.log"),
        ("a.log", b"(1.0) can0 123#00\n", "has 0x123, none of which says JointCommand"),
        ("a.log", b"", "has no frame"),
    ],
)
def test_a_file_that_says_nothing_is_refused_in_one_line(name: str, content: bytes, words: str, tmp_path: Path) -> None:
    (tmp_path / name).write_bytes(content)
    with pytest.raises(MisfitError, match=words) as caught:
        measurement_of_log(tmp_path / name, ARM, tmp_path / "set")
    assert "\n" not in str(caught.value)
    assert not (tmp_path / "set").exists()


@pytest.mark.parametrize("log", [".log"], indirect=True)
def test_the_command_says_what_it_wrote_and_what_it_could_not_explain(log: Path, tmp_path: Path) -> None:
    result = CliRunner().invoke(hil, ["decode", str(log), "--database", "joint_arm", "--out", str(tmp_path / "set")])
    assert result.exit_code == 0, result.output
    assert f"{COUNT - 6} rows of 20 signals at the times of Joint1" in result.output
    assert f"{COUNT} frames that the database does not explain: 0x7a0" in result.output
