"""Operations of FMI-LS-BUS: the bytes that the standard's own C macros make, and every other byte string read or refused."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from hil.codecs.frame import Frame
from hil.codecs.ls_bus.codec import LAST_EXTENDED, Code, decode, encode, frame_of, split
from hil.codecs.ls_bus.operations import (
    ArbitrationLost,
    BusFailure,
    Confirm,
    ErrorCode,
    FormatError,
    NodeState,
    Operation,
    Rate,
    SetArbitration,
    SetRate,
    Status,
    Transmit,
    Wakeup,
)
from hil.errors import FrameError

TORQUES = bytes.fromhex("AA0004002000C004")
# Made by the macros of fmi3LsBusUtilCan.h, which the standard ships.
EXAMPLES: dict[str, Operation] = {
    "10000000180000000104000000000800AA0004002000C004": Transmit(0x401, TORQUES),
    "1000000011000000040400000000010030": Transmit(0x404, b"\x30"),
    "1000000011000000F0DEBC1A0100010030": Transmit(0x1ABCDEF0, b"\x30", extended=True),
    "10000000100000002301000000010000": Transmit(0x123, b"", remote=True),
    "200000000C00000001040000": Confirm(0x401),
    "300000000C00000001040000": ArbitrationLost(0x401),
    "310000000F00000001040000050101": BusFailure(0x401, ErrorCode.ACKNOWLEDGEMENT, first=True, sender=True),
    "310000000F00000023040000040200": BusFailure(0x423, ErrorCode.CHECKSUM, first=False, sender=False),
    "400000000D0000000140420F00": SetRate(Rate.CAN, 1_000_000),
    "400000000D00000002404B4C00": SetRate(Rate.CAN_FD, 5_000_000),
    "400000000A0000000402": SetArbitration(drop=True),
    "400000000A0000000401": SetArbitration(drop=False),
    "410000000900000002": Status(NodeState.PASSIVE),
    "410000000900000003": Status(NodeState.BUS_OFF),
    "4200000008000000": Wakeup(),
    "010000001200000008009900000008000000": FormatError(bytes.fromhex("9900000008000000")),
}

IDENTIFIERS = st.integers(0, LAST_EXTENDED)
OPERATIONS: st.SearchStrategy[Operation] = st.one_of(
    st.builds(FormatError, st.binary(max_size=40)),
    st.tuples(st.integers(0, 0x7FF), st.binary(max_size=8), st.just(False), st.just(False)).map(Transmit._make),
    st.tuples(IDENTIFIERS, st.binary(max_size=8), st.just(True), st.just(False)).map(Transmit._make),
    st.tuples(IDENTIFIERS, st.just(b""), st.just(True), st.just(True)).map(Transmit._make),
    st.builds(Confirm, IDENTIFIERS),
    st.builds(ArbitrationLost, IDENTIFIERS),
    st.builds(BusFailure, IDENTIFIERS, st.sampled_from(ErrorCode), st.booleans(), st.booleans()),
    st.builds(SetRate, st.sampled_from(Rate), st.integers(0, 2**32 - 1)),
    st.builds(SetArbitration, st.booleans()),
    st.builds(Status, st.sampled_from(NodeState)),
    st.just(Wakeup()),
)


@pytest.mark.parametrize(("text", "operation"), EXAMPLES.items())
def test_bytes_are_those_of_the_standards_own_macros_both_ways(text: str, operation: Operation) -> None:
    assert encode(operation).hex().upper() == text
    assert decode(bytes.fromhex(text)) == operation


@given(st.lists(OPERATIONS, max_size=6))
def test_operations_one_after_the_other_come_back(operations: list[Operation]) -> None:
    data = b"".join(map(encode, operations))
    found = [decode(part) for part in split(data)]
    assert found == operations
    assert [type(operation) for operation in found] == [type(operation) for operation in operations]


@given(st.one_of(st.binary(max_size=40), OPERATIONS.map(encode)), st.integers(0, 39), st.integers(0, 255))
def test_every_byte_string_is_read_or_refused_in_one_line(data: bytes, at: int, value: int) -> None:
    changed = data[:at] + bytes([value]) + data[at + 1 :]
    try:
        parts = split(changed)
    except FrameError as error:
        assert "\n" not in str(error)
        return
    assert b"".join(parts) == changed
    for part in parts:
        try:
            operation = decode(part)
        except FrameError as error:
            assert "\n" not in str(error)
            assert decode(encode(FormatError(part))) == FormatError(part), "what cannot be read can be answered"
        else:
            assert encode(operation) == part, "there is one way to write an operation"


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("", "nothing is no operation"),
        ("42000000", "is no operation: code and own length were expected"),
        ("420000000900000000", "operation 0x42 cannot be read: 0 bytes of data are announced, and 1 there"),
        ("9900000008000000", "operation 0x99 cannot be read: there is no such operation"),
        ("110000001200000023010000000100010030", "operation 0x11 cannot be read: CAN FD and CAN XL are not spoken"),
        ("10000000100000000108000000000000", "identifier 0x801 needs more than the 11 bits of a standard frame"),
        ("10000000100000000104000002000000", "2 is no truth value; 0 or 1 was expected"),
        ("10000000190000000104000000000900000102030405060708", "9 bytes of data; up to 8 were expected"),
        ("1000000011000000230100000001010030", "1 bytes of data; up to 0 were expected"),
        ("200000000C00000001040020", "identifier 0x20000401 needs more than 29 bits"),
        ("310000000F00000001040000050301", "3 is no error flag; 1 or 2 was expected"),
        ("310000000F00000001040000070101", "7 is not a valid ErrorCode"),
        ("400000000A0000000403", "3 is no behaviour; 1 or 2 was expected"),
        ("410000000900000004", "4 is not a valid NodeState"),
    ],
)
def test_what_the_standard_does_not_allow_is_named(text: str, words: str) -> None:
    with pytest.raises(FrameError) as caught:
        decode(bytes.fromhex(text))
    assert words in str(caught.value)


@pytest.mark.parametrize("size", [0, 7, 9, 2**32 - 1])
def test_a_length_that_leads_nowhere_ends_the_reading_with_its_place(size: int) -> None:
    data = encode(Wakeup()) + Code.WAKEUP.to_bytes(4, "little") + size.to_bytes(4, "little")
    with pytest.raises(FrameError, match=f"the operation at byte 8 says it has {size} bytes, and 8 bytes are left"):
        split(data)


@pytest.mark.parametrize(
    "operation",
    [
        Transmit(0x800, b""),
        Transmit(0x7FF, bytes(9)),
        Transmit(-1, b""),
        Transmit(1, b"\x00", remote=True),
        Confirm(2**29),
        SetRate(Rate.CAN, 2**32),
        FormatError(bytes(2**16)),
    ],
)
def test_what_an_operation_cannot_hold_is_not_written(operation: Operation) -> None:
    with pytest.raises(FrameError, match="^(FMI-LS-BUS: operation|.* cannot be written as an operation of FMI-LS-BUS)"):
        encode(operation)


@given(st.integers(0, 0x7FF), st.binary(max_size=8))
def test_a_frame_of_the_session_goes_through_and_no_other_is_taken_for_one(identifier: int, data: bytes) -> None:
    frame = Frame(identifier, data)
    assert frame_of(decode(encode(Transmit(*frame)))) == frame
    others = (Transmit(*frame, extended=True), Transmit(identifier, b"", remote=True), Confirm(identifier), Wakeup())
    assert [frame_of(other) for other in others] == [None] * len(others)
