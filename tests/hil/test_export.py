"""Frames of a recording in the formats of other tools come back as they were."""

import tempfile
from operator import itemgetter
from pathlib import Path

import can
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from fmus.errors import MisfitError
from hil.codecs.frame import Frame, Timed
from hil.recording.frames import FORMATS, write_frames
from hil.recording.records import MAGIC, RECORD, Kind, pack_begin, pack_cycle, pack_frame

FRAMES = [
    (Kind.SENT, 1_000_000_000, 0x404, b"\x30"),
    (Kind.RECEIVED, 1_000_225_000, 0x423, bytes.fromhex("000593")),
    (Kind.SENT, 1_000_500_000, 0x401, bytes.fromhex("AA00040020 00C004")),
]


@pytest.fixture
def recording(tmp_path: Path) -> Path:
    frames = [pack_frame(kind, Timed(at, Frame(number, data))) for kind, at, number, data in FRAMES]
    decided = pack_frame(Kind.DECIDED, Timed(0, Frame(0x401, b"")))
    (tmp_path / "frames.bin").write_bytes(MAGIC + pack_begin(0) + b"".join(frames) + pack_cycle(0, 0, 0) + decided)
    return tmp_path


@pytest.mark.parametrize("ending", FORMATS)
def test_frames_on_the_bus_come_back_in_their_order(recording: Path, ending: str) -> None:
    path = recording / f"out{ending}"
    assert write_frames(recording, path) == len(FRAMES)
    with can.LogReader(str(path)) as reader:
        found = list(reader)
    assert [(message.arbitration_id, bytes(message.data)) for message in found] == [frame[2:] for frame in FRAMES]
    gaps = [message.timestamp - found[0].timestamp for message in found]
    assert gaps == pytest.approx([0.0, 225e-6, 500e-6], abs=2e-6 if ending != ".trc" else 1e-4)


@pytest.mark.parametrize("ending", [".blf", ".mf4", ".log"])
def test_the_direction_of_frames_is_kept(recording: Path, ending: str) -> None:
    path = recording / f"out{ending}"
    write_frames(recording, path)
    with can.LogReader(str(path)) as reader:
        assert [message.is_rx for message in reader] == [False, True, False]


@pytest.mark.parametrize("ending", [".blf", ".mf4"])
def test_two_exports_are_the_same_bytes(recording: Path, ending: str) -> None:
    first, second = recording / f"first{ending}", recording / f"second{ending}"
    write_frames(recording, first)
    write_frames(recording, second)
    assert first.read_bytes() == second.read_bytes()


@given(
    st.lists(
        st.tuples(st.sampled_from(Kind), st.integers(0, 10**15), st.integers(0, 0x7FF), st.binary(max_size=8)),
        max_size=20,
    ),
    st.integers(0, RECORD.size - 1),
)
@settings(max_examples=15)
def test_mf4_holds_exactly_the_frames_that_were_on_the_bus(
    records: list[tuple[Kind, int, int, bytes]], cut_off: int
) -> None:
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        written = [
            pack_frame(kind, Timed(at, Frame(number, data)))
            for kind, at, number, data in sorted(records, key=itemgetter(1))
        ]
        (folder / "frames.bin").write_bytes(MAGIC + b"".join(written) + bytes(cut_off))
        expected = [record for record in sorted(records, key=itemgetter(1)) if record[0] in (Kind.RECEIVED, Kind.SENT)]
        assert write_frames(folder, folder / "out.mf4") == len(expected)
        with can.LogReader(str(folder / "out.mf4")) as reader:
            found = list(reader)
    assert [(m.arbitration_id, bytes(m.data), m.is_rx) for m in found] == [
        (number, data, kind is Kind.RECEIVED) for kind, _, number, data in expected
    ]
    assert [m.timestamp for m in found] == [at * 1e-9 for _, at, _, _ in expected]


@pytest.mark.parametrize("ending", [".mf4", ".log"])
def test_a_damaged_recording_is_not_exported(recording: Path, ending: str) -> None:
    with (recording / "frames.bin").open("ab") as file:
        file.write(b"\x09" * RECORD.size)
    with pytest.raises(MisfitError, match="frames.bin is damaged: a record of the kind 9"):
        write_frames(recording, recording / f"out{ending}")
    assert not (recording / f"out{ending}").exists()


@pytest.mark.parametrize("name", ["out.csv", "out"])
def test_a_format_that_loses_something_is_refused(recording: Path, name: str) -> None:
    with pytest.raises(MisfitError, match="frames are written as .blf, .asc"):
        write_frames(recording, recording / name)


def test_a_recording_that_is_not_there_leaves_no_file(tmp_path: Path) -> None:
    with pytest.raises(MisfitError, match="cannot be read"):
        write_frames(tmp_path / "nowhere", tmp_path / "out.blf")
    assert list(tmp_path.iterdir()) == []
