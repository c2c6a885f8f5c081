"""The DBC of Barrett's robots against our own codecs: two ways from the same bytes to the same numbers."""

import math
from collections.abc import Mapping
from pathlib import Path

import pytest
from click.testing import CliRunner
from hypothesis import given
from hypothesis import strategies as st

from fmus.errors import MisfitError
from hil.cli import hil
from hil.codecs.barrett.database import ROBOTS, dbc_of
from hil.codecs.barrett.force_torque import pack_reading, unpack_reading
from hil.codecs.barrett.identifiers import Group, Node, answer_of
from hil.codecs.barrett.positions import HIGHEST, LOWEST, pack_positions
from hil.codecs.barrett.properties import encode_value
from hil.codecs.barrett.safety_module import Button, Level, Pendant, encode_pendant
from hil.codecs.barrett.tables import Kind, properties
from hil.codecs.barrett.torques import MOST, pack_torques
from hil.codecs.database import Database
from hil.codecs.frame import Frame
from hil.errors import FrameError
from hil.logs import measurement_of_log
from hil.robots import proficio
from orchestrator.measurements import load_measurements
from tests.hil.bench import Bench

PROFICIO, WAM = Database("proficio"), Database("wam7")
UNITS = st.integers(-MOST, MOST)
INT16 = st.integers(-(2**15), 2**15 - 1)


def signals(database: Database, identifier: int, data: bytes) -> Mapping[str, float]:
    return database.decode(Frame(identifier, data)).signals


@given(UNITS, UNITS, UNITS, UNITS)
def test_torques_are_those_that_our_codec_packed(a: int, b: int, c: int, d: int) -> None:
    data = pack_torques([a, b, c, d])
    expected = {f"Torque{k}": units / 2700 for k, units in enumerate((a, b, c, d), start=1)}
    assert signals(WAM, 0x401, data) == pytest.approx(expected)
    assert signals(PROFICIO, 0x401, data) == pytest.approx({k: expected[k] for k in ("Torque1", "Torque2", "Torque3")})
    upper = {f"Torque{k}": units / 2700 for k, units in enumerate((a, b, c), start=5)}
    assert signals(WAM, 0x402, data) == pytest.approx(upper)


@given(st.integers(1, 7), st.integers(LOWEST, HIGHEST), st.none() | st.integers(LOWEST, HIGHEST))
def test_angles_are_those_that_our_codec_packed_with_and_without_a_joint_encoder(
    motor: int, counts: int, joint: int | None
) -> None:
    found = signals(WAM, answer_of(motor, Group.POSITIONS), pack_positions(counts, joint))
    assert found == pytest.approx({"Angle": counts * 2 * math.pi / 4096})


@given(INT16, INT16, INT16, st.sampled_from([(Group.FORCE, 256), (Group.TORQUE, 4096), (Group.ACCELERATION, 1024)]))
def test_readings_are_those_that_our_codec_unpacks(x: int, y: int, z: int, of: tuple[Group, int]) -> None:
    group, divisor = of
    data = pack_reading(group, (x / divisor, y / divisor, z / divisor))
    found = signals(PROFICIO, answer_of(Node.FORCE_SENSOR, group), data)
    assert tuple(found[axis] for axis in "XYZ") == pytest.approx(unpack_reading(group, data)[:3])


@given(
    st.builds(
        Pendant,
        st.sampled_from(Button),
        st.booleans(),
        st.booleans(),
        st.integers(0, 255),
        *[st.sampled_from(Level)] * 5,
    )
)
def test_the_pendant_is_the_one_that_our_codec_packed(pendant: Pendant) -> None:
    found = signals(PROFICIO, 0x546, encode_value(43, encode_pendant(pendant)))
    names = ("Button", "ActivateLight", "IdleLight", "Display", "Other", "Heartbeat", "Voltage", "Torque", "Velocity")
    assert [found[f"Pendant{name}"] for name in names] == [int(part) for part in pendant]


@pytest.mark.parametrize("size", [2, 4])
@pytest.mark.parametrize("version", [100, 116, 200])
def test_every_property_of_a_motor_is_decoded_by_its_name_in_both_lengths(
    version: int, size: int, tmp_path: Path
) -> None:
    path = tmp_path / "motors.dbc"
    path.write_text(dbc_of("proficio", version=version))
    motors = Database(path)
    for name, number in properties(Kind.MOTOR, version).items():
        frame = Frame(0x446, encode_value(number, -321, size))
        try:
            assert motors.decode(frame).signals[name] == -321
        except FrameError as error:  # a long value in a short frame: refused, not read wrongly
            assert size == 2 and "too short" in str(error)


@pytest.mark.parametrize("robot", ROBOTS)
def test_a_robot_has_a_message_for_the_position_of_each_of_its_motors(robot: str) -> None:
    assert sum(name.startswith("Position") for name in Database(robot).messages) == ROBOTS[robot]


def test_other_scales_of_motors_are_said_to_the_command_and_end_in_the_file(tmp_path: Path) -> None:
    path = tmp_path / "mine.dbc"
    found = CliRunner().invoke(hil, ["dbc", "proficio", str(path), "--counts", "8192", "--torque-units", "1000"])
    assert found.exit_code == 0, found.output
    mine = Database(path)
    assert signals(mine, 0x423, pack_positions(8192)) == pytest.approx({"Angle": 2 * math.pi})
    assert signals(mine, 0x401, pack_torques([500]))["Torque1"] == pytest.approx(0.5)


@pytest.mark.parametrize(("robot", "counts"), [("hand", 4096.0), ("proficio", 0.0), ("proficio", math.nan)])
def test_a_robot_or_a_scale_that_there_is_not_is_refused(robot: str, counts: float) -> None:
    with pytest.raises(MisfitError, match="there is no robot 'hand'|positive numbers were expected"):
        dbc_of(robot, counts)


def test_a_candump_log_of_a_session_becomes_a_measurement_set_with_its_angles(tmp_path: Path) -> None:
    bench = Bench()
    heard = []
    bench.wire.tap = lambda timed, sent: heard.append(timed)
    bench.run(bench.pilot(), 200)
    bench.wire.close()
    log = tmp_path / "session.log"
    log.write_text("".join(f"({timed.time_ns * 1e-9:.6f}) can0 {timed.frame}\n" for timed in heard))
    written = measurement_of_log(log, PROFICIO, tmp_path / "set", "Position1")
    assert set(written.others) <= set(range(1, 32)) - {1, 2, 3, 8, 10}  # questions to nodes that are not there
    trial = load_measurements(tmp_path / "set").trials[0]
    plant = proficio.motor_angles(bench.plant.angles)
    assert trial.columns["Position1.Angle"][-1] == pytest.approx(plant[0], abs=0.05)
