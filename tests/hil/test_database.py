"""Frames of any robot by a database of its messages; the shipped one describes an arm that is commanded by torque."""

import math
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from fmus.errors import MisfitError
from hil.codecs.database import JOINT_ARM, Database
from hil.codecs.frame import Frame
from hil.errors import FrameError, ValueRangeError

ARM = Database(JOINT_ARM)
TORQUE = st.integers(-32000, 32000).map(lambda n: 0.005 * n)


@given(st.integers(0, 2), st.integers(0, 15), TORQUE, TORQUE, TORQUE)
def test_a_command_comes_back_as_it_went(mode: int, counter: int, t1: float, t2: float, t3: float) -> None:
    given = {"Mode": mode, "Counter": counter, "Torque1": t1, "Torque2": t2, "Torque3": t3}
    frame = ARM.encode("JointCommand", given)
    assert (frame.identifier, len(frame.data)) == (0x100, 8)
    decoded = ARM.decode(frame)
    assert decoded.message == "JointCommand"
    assert decoded.signals == pytest.approx(given)


@given(st.integers(-8_000_000, 8_000_000), st.integers(-32_000, 32_000))
def test_a_joints_answer_has_its_bytes_where_the_layout_says(counts: int, speed: int) -> None:
    frame = ARM.encode(
        "Joint2", {"Position": counts * 1e-6, "Speed": speed * 1e-3, "Torque": 0.0, "Counter": 5, "Valid": 1}
    )
    assert frame.identifier == 273
    assert int.from_bytes(frame.data[0:3], "little", signed=True) == counts
    assert int.from_bytes(frame.data[3:5], "little", signed=True) == speed
    assert frame.data[7] == 0x15


def test_the_arm_has_its_messages_and_units() -> None:
    assert ARM.messages == ("JointCommand", "Joint1", "Joint2", "Joint3", "WristForce", "ArmState")
    assert ARM.units("Joint1") == {"Position": "rad", "Speed": "rad/s", "Torque": "N.m", "Counter": "1", "Valid": "1"}


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"Torque1": 161.0}, r"Torque1 = 161.0 N.m is outside \[-160, 160\] N.m"),
        ({"Torque2": math.nan}, "Torque2 = nan"),
        ({"Mode": 3}, "Mode = 3 is outside"),
        ({"Torque4": 0.0}, "has no signal Torque4; signals are Mode"),
        ({"Torque3": None}, "needs Torque3"),
    ],
)
def test_what_a_frame_cannot_carry_is_refused_and_not_clipped(change: dict, words: str) -> None:
    calm = {"Mode": 1, "Counter": 0, "Torque1": 0.0, "Torque2": 0.0, "Torque3": 0.0}
    with pytest.raises(ValueRangeError, match=words):
        ARM.encode("JointCommand", calm | change)


@given(st.integers(0, 0x7FF), st.binary(max_size=8))
def test_every_frame_is_decoded_or_refused_by_name(identifier: int, data: bytes) -> None:
    try:
        decoded = ARM.decode(Frame(identifier, data))
    except FrameError as error:
        assert "\n" not in str(error)
    else:
        assert decoded.message in ARM.messages


def test_a_frame_that_is_too_short_is_refused() -> None:
    with pytest.raises(FrameError, match="is no Joint1"):
        ARM.decode(Frame(272, b"\x01\x02"))


def test_a_kcd_file_does_as_well(tmp_path: Path) -> None:
    path = tmp_path / "one.kcd"
    path.write_text(
        '<?xml version="1.0"?><NetworkDefinition xmlns="http://kayak.2codeornot2code.org/1.0"><Document/>'
        '<Bus name="can0"><Message id="0x123" name="Grip" length="2"><Signal name="Force" offset="0" length="16">'
        '<Value slope="0.5" unit="N"/></Signal></Message></Bus></NetworkDefinition>'
    )
    grip = Database(path)
    assert grip.units("Grip") == {"Force": "N"}
    assert grip.decode(Frame(0x123, b"\x04\x00")).signals == {"Force": 2.0}


@pytest.mark.parametrize(("text", "words"), [("hello", "no database of CAN messages"), ("BO_ 1", "no database")])
def test_a_file_that_is_no_database_is_refused_in_one_line(tmp_path: Path, text: str, words: str) -> None:
    path = tmp_path / "odd.dbc"
    path.write_text(text)
    with pytest.raises(MisfitError, match=words) as caught:
        Database(path)
    assert "\n" not in str(caught.value)


def test_a_database_or_message_that_is_not_there_is_named() -> None:
    with pytest.raises(MisfitError, match="nowhere.dbc cannot be read"):
        Database("nowhere.dbc")
    with pytest.raises(MisfitError, match="message 'Grip' is not in the database; there are JointCommand"):
        ARM.encode("Grip", {})
