"""Frames as text: wherever a stream is split the same frames come out, and whatever comes is a frame, an error or nothing."""

import string

import can
import pytest
from can.interfaces.socketcand.socketcand import convert_ascii_message_to_can_message
from hypothesis import given
from hypothesis import strategies as st

from hil.codecs import slcan, socketcand
from hil.codecs.can_text import Language
from hil.codecs.frame import Frame
from hil.codecs.slcan import SLCAN
from hil.codecs.socketcand import SOCKETCAND
from hil.errors import FrameError
from hil.virtual.adapters import SerialAdapter
from hil.virtual.socketcand import _frame_of

LANGUAGES = pytest.mark.parametrize("language", [SOCKETCAND, SLCAN], ids=["socketcand", "slcan"])
frames = st.builds(Frame, st.integers(0, 0x7FF), st.binary(max_size=8))
extended = st.builds(
    lambda identifier, data: can.Message(arbitration_id=identifier, data=data),
    st.integers(0, 0x1FFFFFFF),
    st.binary(max_size=8),
)
HEX = st.text(string.hexdigits, max_size=20)
# What a server or an adapter says, what it should not say, and noise; long ones go past the limits of a saying.
SAYINGS = st.one_of(
    frames.map(lambda frame: f"< frame {frame.identifier:03X} 1.5 {frame.data.hex().upper()} >"),
    frames.map(lambda frame: f"t{frame.identifier:03X}{len(frame.data)}{frame.data.hex()}\r"),
    st.sampled_from(["< ok >", "< hi >", "< error 20 1.5 >", "\r", "\a", "<", ">", "< frame ", "t12", "z\r"]),
    st.builds(str.__mul__, st.sampled_from(["<", "x", "< frame 123 1.5 0", "t", "\r"]), st.integers(1, 300)),
    st.text(st.characters(max_codepoint=255), max_size=20),
)


def sayings_of(language: Language, parts: list[str]) -> list[str]:
    found, rest = [], ""
    for part in parts:
        texts, rest = language.cut(rest + part)
        found += texts
    return found


@LANGUAGES
@given(st.lists(SAYINGS, max_size=8).map("".join), st.data())
def test_any_split_of_a_stream_gives_the_same_sayings(language: Language, stream: str, data: st.DataObject) -> None:
    cuts = sorted(data.draw(st.lists(st.integers(0, len(stream)), max_size=12)))
    parts = [stream[a:b] for a, b in zip([0, *cuts], [*cuts, len(stream)], strict=True)]
    assert sayings_of(language, parts) == sayings_of(language, [stream]) == sayings_of(language, list(stream))


@LANGUAGES
@given(st.text(st.characters(max_codepoint=255), max_size=2000))
def test_what_waits_for_its_end_is_bounded(language: Language, noise: str) -> None:
    rest = ""
    for part in (noise, "<" * 300, "< " + "x" * 5000, "t" * 5000):
        _, rest = language.cut(rest + part)
        assert len(rest) <= 257


@LANGUAGES
@given(
    st.one_of(
        st.text(st.characters(max_codepoint=255)), SAYINGS, HEX.map(lambda t: "t" + t), HEX.map(lambda t: "R" + t)
    )
)
def test_every_saying_is_a_standard_frame_another_message_or_nothing(language: Language, text: str) -> None:
    heard = language.parse(text.strip("<>\r"))
    if isinstance(heard, Frame):
        assert 0 <= heard.identifier <= 0x7FF and len(heard.data) <= 8
    elif heard is not None:
        assert heard.is_error_frame or heard.is_extended_id or heard.is_remote_frame


@given(st.lists(frames, max_size=20))
def test_frames_of_a_server_come_out_whatever_is_between_them(sent: list[Frame]) -> None:
    stream = "".join(f"noise >< frame {f.identifier:03X} 12.000345 {f.data.hex().upper()} >< fra" for f in sent)
    texts, _ = socketcand.cut(stream)
    assert [socketcand.parse(text) for text in texts if "frame" in text] == sent
    assert {socketcand.stamp(text) for text in texts if "frame" in text} <= {12.000345}


@given(frames, st.sampled_from(["", " ", "  "]), st.sampled_from(["", " "]))
def test_blanks_around_and_between_a_servers_bytes_do_not_matter(frame: Frame, blanks: str, between: str) -> None:
    data = frame.data.hex(between) if between else frame.data.hex()
    assert socketcand.parse(f" frame {frame.identifier:03X} 1.5{' ' if frame.data else ''}{data}{blanks}") == frame


@given(
    st.one_of(
        frames.map(lambda f: (f"{f.identifier:03X}", f.data)),
        extended.map(lambda m: (f"{m.arbitration_id:08X}", m.data)),
    )
)
def test_python_can_reads_the_same_out_of_a_servers_frame(case: tuple[str, bytes]) -> None:
    digits, data = case
    text = f"< frame {digits} 17.25 {bytes(data).hex().upper()} >"
    (saying,), rest = socketcand.cut(text)
    heard, theirs = socketcand.parse(saying), convert_ascii_message_to_can_message(text)
    assert rest == ""
    if isinstance(heard, Frame):
        heard = can.Message(arbitration_id=heard.identifier, data=heard.data, is_extended_id=False)
    assert heard is not None and heard.equals(theirs, timestamp_delta=None, check_direction=False)
    assert socketcand.stamp(saying) == theirs.timestamp


@given(frames)
def test_a_server_and_an_adapter_understand_what_is_written(frame: Frame) -> None:
    (saying,), _ = socketcand.cut(SOCKETCAND.write(frame).decode())
    assert _frame_of([word.encode() for word in saying.split()][1:]) == frame
    message = can.Message(arbitration_id=frame.identifier, data=frame.data, is_extended_id=False)
    assert SOCKETCAND.write_message(message) == SOCKETCAND.write(frame)
    assert SLCAN.write_message(message) == SLCAN.write(frame)
    (line,), _ = slcan.cut(SLCAN.write(frame).decode())
    assert slcan.parse(line) == frame
    with SerialAdapter() as adapter:
        adapter.hear(SLCAN.write(frame))
        assert adapter.recv(0.0).equals(message, timestamp_delta=None)


@given(st.integers(0, 0x1FFFFFFF), st.binary(max_size=8), st.booleans(), st.booleans())
def test_an_adapter_speaks_of_every_classic_message(
    identifier: int, data: bytes, is_extended: bool, remote: bool
) -> None:
    message = can.Message(
        arbitration_id=identifier if is_extended else identifier & 0x7FF,
        is_extended_id=is_extended,
        is_remote_frame=remote,
        dlc=len(data),
        data=None if remote else data,
    )
    (line,), _ = slcan.cut(SLCAN.write_message(message).decode())
    heard = slcan.parse(line)
    if isinstance(heard, Frame):
        assert (heard.identifier, heard.data, is_extended, remote) == (message.arbitration_id, data, False, False)
    else:
        assert heard is not None and heard.equals(message, timestamp_delta=None)


@pytest.mark.parametrize(
    "line", ["t1233AABB", "t1232AABBC", "t1232AABBCCD", "t8000", "t12390", "t１２30", "T1232AABB", "r0000012"]
)
def test_a_line_of_the_wrong_length_is_nothing(line: str) -> None:
    assert slcan.parse(line) is None


def test_the_time_that_an_adapter_adds_is_no_data() -> None:
    assert slcan.parse("t1232AABB1F40") == Frame(0x123, b"\xaa\xbb")


@LANGUAGES
@pytest.mark.parametrize(
    "message",
    [can.Message(is_fd=True, data=bytes(12)), can.Message(is_error_frame=True)],
    ids=["FD", "error"],
)
def test_a_message_that_the_other_side_would_take_for_another_one_is_refused(
    language: Language, message: can.Message
) -> None:
    with pytest.raises(FrameError, match="not sent"):
        language.write_message(message)


@pytest.mark.parametrize("text", [" error 00000004 17.25 ", " error 20 1.0", " error unknown command "])
def test_an_error_of_a_server_is_an_error_whatever_it_says(text: str) -> None:
    heard = socketcand.parse(text)
    assert isinstance(heard, can.Message) and heard.is_error_frame
    assert socketcand.stamp(text) in (17.25, 1.0, None)
