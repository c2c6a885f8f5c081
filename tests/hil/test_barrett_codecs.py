"""Barrett's frames against worked examples of the protocol, and round trips over all values."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from fmus.errors import MisfitError
from hil.codecs.barrett import force_torque
from hil.codecs.barrett.force_torque import Reading, Status, pack_reading, unpack_reading
from hil.codecs.barrett.identifiers import Address, Group, Node, address_of, answer_of, to_group, to_node
from hil.codecs.barrett.positions import (
    HIGHEST,
    LOWEST,
    Positions,
    motor_counts,
    nearest_turn,
    pack_positions,
    unpack_positions,
)
from hil.codecs.barrett.properties import PropertyValue, decode_request, decode_value, encode_request, encode_value
from hil.codecs.barrett.safety_module import Button, Level, Mode, Pendant, decode_mode, decode_pendant, encode_pendant
from hil.codecs.barrett.tables import MONITOR, Kind, kind_of, properties
from hil.codecs.barrett.torques import MOST, pack_torques, saturated, unpack_torques
from hil.codecs.frame import Frame, parse_frame
from hil.errors import FrameError, ValueRangeError

MOTOR, SAFETY, FORCE = (properties(kind, 200) for kind in Kind)
DATA = st.binary(max_size=8)


def data(text: str) -> bytes:
    return bytes.fromhex(text)


@pytest.mark.parametrize(
    ("identifier", "expected"),
    [
        (to_node(1), 0x001),
        (to_node(Node.FORCE_SENSOR), 0x008),
        (to_node(Node.SAFETY), 0x00A),
        (to_group(Group.ALL), 0x400),
        (to_group(Group.LOWER_TORQUES), 0x401),
        (to_group(Group.ARM), 0x404),
        (answer_of(1, Group.POSITIONS), 0x423),
        (answer_of(2, Group.POSITIONS), 0x443),
        (answer_of(3, Group.PROPERTIES), 0x466),
        (answer_of(1, Group.JOINT_POSITIONS), 0x427),
        (answer_of(Node.FORCE_SENSOR, Group.PROPERTIES), 0x506),
        (answer_of(Node.FORCE_SENSOR, Group.FORCE), 0x50A),
        (answer_of(Node.FORCE_SENSOR, Group.TORQUE), 0x50B),
        (answer_of(Node.FORCE_SENSOR, Group.ACCELERATION), 0x50C),
        (answer_of(Node.SAFETY, Group.PROPERTIES), 0x546),
        (answer_of(Node.SAFETY, Group.ALL), 0x540),
    ],
)
def test_identifiers_of_a_proficio_are_those_of_the_protocol(identifier: int, expected: int) -> None:
    assert identifier == expected


@given(st.integers(0, 0x7FF))
def test_every_identifier_is_one_address_and_every_address_one_identifier(identifier: int) -> None:
    assert address_of(identifier).identifier == identifier


@pytest.mark.parametrize("address", [Address(32, 0), Address(0, -1)])
def test_an_address_outside_the_bus_is_refused(address: Address) -> None:
    with pytest.raises(ValueRangeError, match=r"outside \[0, 31\]"):
        _ = address.identifier


@pytest.mark.parametrize("identifier", [-1, 0x800])
def test_no_address_is_made_of_an_identifier_that_is_not_standard(identifier: int) -> None:
    with pytest.raises(FrameError, match="outside"):
        address_of(identifier)


@pytest.mark.parametrize(
    ("number", "value", "size", "expected"),
    [
        (MOTOR["STAT"], 0, 2, "85 00 00 00"),
        (MOTOR["STAT"], 2, 2, "85 00 02 00"),
        (MOTOR["ROLE"], 0x4100, 2, "81 00 00 41"),
        (MOTOR["VERS"], 200, 2, "80 00 C8 00"),
        (MOTOR["STAT"], 2, 4, "85 00 02 00 00 00"),
        (MOTOR["CTS"], 4096, 4, "C4 00 00 10 00 00"),
        (MOTOR["IPNM"], 2700, 2, "D6 00 8C 0A"),
        (MOTOR["TEMP"], -5, 2, "89 00 FB FF"),
        (MOTOR["MODE"], 2, 4, "88 00 02 00 00 00"),
        (MOTOR["MODE"], 0, 4, "88 00 00 00 00 00"),
        (MOTOR["SAVE"], -1, 4, "9E 00 FF FF FF FF"),
        (MOTOR["P"], -3908, 4, "B0 00 BC F0 FF FF"),
        (MOTOR["P"], 17680, 4, "B0 00 10 45 00 00"),
        (SAFETY["MODE"], 1, 2, "88 00 01 00"),
        (SAFETY["ZERO"], 1, 4, "AA 00 01 00 00 00"),
        (SAFETY["IFAULT"], 5, 4, "B7 00 05 00 00 00"),
        (SAFETY["DEF"], SAFETY["VL1"], 4, "A0 00 2D 00 00 00"),
        (SAFETY["LOAD"], SAFETY["VL1"], 4, "9F 00 2D 00 00 00"),
        (SAFETY["VL2"], 6144, 4, "AE 00 00 18 00 00"),
        (SAFETY["VL1"], 5529, 4, "AD 00 99 15 00 00"),
        (SAFETY["TL2"], 6750, 4, "B0 00 5E 1A 00 00"),
        (SAFETY["TL1"], 6075, 4, "AF 00 BB 17 00 00"),
        (SAFETY["PEN"], 0x0D3F1249, 4, "AB 00 49 12 3F 0D"),
        (SAFETY["PEN"], 0x0D791849, 4, "AB 00 49 18 79 0D"),
        (FORCE["FT"], 0, 4, "B6 00 00 00 00 00"),
    ],
)
def test_property_values_are_the_bytes_of_the_protocol_both_ways(
    number: int, value: int, size: int, expected: str
) -> None:
    assert encode_value(number, value, size) == data(expected)
    assert decode_value(data(expected), number) == PropertyValue(number, value)


@pytest.mark.parametrize(
    ("number", "expected"),
    [
        (MOTOR["STAT"], "05"),
        (MOTOR["CTS"], "44"),
        (MOTOR["IPNM"], "56"),
        (MOTOR["P"], "30"),
        (SAFETY["MODE"], "08"),
        (SAFETY["ZERO"], "2A"),
        (SAFETY["PEN"], "2B"),
        (FORCE["FT"], "36"),
        (FORCE["A"], "40"),
    ],
)
def test_requests_are_the_bytes_of_the_protocol_both_ways(number: int, expected: str) -> None:
    assert encode_request(number) == data(expected)
    assert decode_request(data(expected)) == number


@given(st.integers(0, 127), st.integers(-(2**31), 2**31 - 1))
def test_a_property_value_comes_back(number: int, value: int) -> None:
    assert decode_value(encode_value(number, value)) == (number, value)


@given(st.integers(0, 127), st.integers(-(2**15), 2**15 - 1))
def test_a_short_property_value_comes_back(number: int, value: int) -> None:
    assert decode_value(encode_value(number, value, 2)) == (number, value)


@pytest.mark.parametrize(("value", "size"), [(1 << 15, 2), (-(1 << 15) - 1, 2), (1 << 31, 4), (-(1 << 31) - 1, 4)])
def test_a_value_that_does_not_fit_is_refused_with_its_limits(value: int, size: int) -> None:
    with pytest.raises(ValueRangeError, match=f"property 5 = {value} is outside"):
        encode_value(5, value, size)


def test_an_answer_to_an_older_question_is_told_from_the_one_awaited() -> None:
    with pytest.raises(FrameError, match="property 5 arrived where 68 was asked for"):
        decode_value(data("85 00 02 00"), MOTOR["CTS"])


@pytest.mark.parametrize(
    ("torques", "expected"),
    [
        ((0, 0, 0, 0), "AA 00 00 00 00 00 00 00"),
        ((1, 2, 3, 4), "AA 00 04 00 20 00 C0 04"),
        ((-1, -1, -1, -1), "AA FF FF FF FF FF FF FF"),
        ((100, -100, 8191, 0), "AA 01 93 F9 C7 FF C0 00"),
        ((1000, -2000, 3000, -4000), "AA 0F A3 83 02 EE 30 60"),
        ((8191, -8191, -1, 0), "AA 7F FE 00 1F FF C0 00"),
        ((-1060, 526, 565, 0), "AA EF 70 20 E0 8D 40 00"),
    ],
)
def test_torques_are_the_bytes_of_the_protocol_both_ways(torques: tuple[int, ...], expected: str) -> None:
    assert pack_torques(torques) == data(expected)
    assert unpack_torques(data(expected)) == torques


@given(st.lists(st.integers(-MOST, MOST), min_size=4, max_size=4))
def test_torques_come_back_and_are_the_documented_word(torques: list[int]) -> None:
    packed = pack_torques(torques)
    word = sum((torque % 2**14) << shift for torque, shift in zip(torques, (42, 28, 14, 0), strict=True))
    assert packed == b"\xaa" + word.to_bytes(7, "big")
    assert list(unpack_torques(packed)) == torques


@pytest.mark.parametrize("torques", [(8192,), (0, -8192), (0, 0, 0, 0, 0)])
def test_torques_that_do_not_fit_are_refused_not_wrapped(torques: tuple[int, ...]) -> None:
    with pytest.raises(ValueRangeError, match="outside|do not fit"):
        pack_torques(torques)


@pytest.mark.parametrize("torque", [math.nan, math.inf, -math.inf])
def test_a_torque_that_is_no_number_never_becomes_counts(torque: float) -> None:
    with pytest.raises(ValueRangeError, match="torque of slot 1 is"):
        saturated([0.0, torque])


@given(st.floats(allow_nan=False, allow_infinity=False))
def test_saturated_torques_fit_and_are_at_most_one_count_below(torque: float) -> None:
    (counts,) = saturated([torque])
    assert -MOST <= counts <= MOST
    if abs(torque) < MOST:
        assert 0 <= torque - counts <= 1  # rounding makes the difference 1 for the smallest negative torques


@pytest.mark.parametrize(
    ("counts", "expected"),
    [
        (0, "00 00 00"),
        (2, "00 00 02"),
        (-2, "3F FF FE"),
        (1000, "00 03 E8"),
        (-1000, "3F FC 18"),
        (2097151, "1F FF FF"),
        (-2097152, "20 00 00"),
        (-3908, "3F F0 BC"),
        (-15114, "3F C4 F6"),
        (17680, "00 45 10"),
        (15113, "00 3B 09"),
        (-17681, "3F BA EF"),
    ],
)
def test_positions_are_the_bytes_of_the_protocol_both_ways(counts: int, expected: str) -> None:
    assert pack_positions(counts) == data(expected)
    assert unpack_positions(data(expected)) == Positions(counts)


@given(st.integers(LOWEST, HIGHEST), st.none() | st.integers(LOWEST, HIGHEST))
def test_positions_come_back(motor: int, joint: int | None) -> None:
    assert unpack_positions(pack_positions(motor, joint)) == (motor, joint)
    assert motor_counts(pack_positions(motor, joint)) == motor


def test_the_unused_bits_of_a_position_are_ignored() -> None:
    assert unpack_positions(data("C0 03 E8")).motor == motor_counts(data("C0 03 E8")) == 1000


@pytest.mark.parametrize("counts", [LOWEST - 1, HIGHEST + 1])
def test_a_position_that_does_not_fit_is_refused(counts: int) -> None:
    with pytest.raises(ValueRangeError, match="position"):
        pack_positions(counts)


@given(st.integers(-(10**9), 10**9), st.integers(-(2**21) + 1, 2**21 - 1))
def test_a_wrapped_position_is_followed_over_any_number_of_turns(before: int, moved: int) -> None:
    true = before + moved
    wrapped = (true + 2**21) % 2**22 - 2**21
    assert nearest_turn(wrapped, before) == true


@pytest.mark.parametrize(
    ("group", "values", "status", "expected"),
    [
        (Group.FORCE, (1.0, -2.5, 10.25), None, "00 01 80 FD 40 0A"),
        (Group.TORQUE, (0.5, -0.25, 0.0), None, "00 08 00 FC 00 00"),
        (Group.TORQUE, (0.5, -0.25, 0.0), Status(True, False, (0,)), "00 08 00 FC 00 00 81"),
        (Group.ACCELERATION, (0.0, 0.0, -10042 / 1024), None, "00 00 00 00 C6 D8"),
    ],
)
def test_forces_are_the_bytes_of_the_protocol_both_ways(
    group: Group, values: tuple[float, float, float], status: Status | None, expected: str
) -> None:
    assert pack_reading(group, values, status) == data(expected)
    assert unpack_reading(group, data(expected)) == Reading(*values, status)


@given(st.sampled_from(list(force_torque.DIVISORS)), st.lists(st.floats(-7.9, 7.9), min_size=3, max_size=3))
def test_a_force_comes_back_within_half_a_count(group: Group, values: list[float]) -> None:
    back = unpack_reading(group, pack_reading(group, values))
    half = 0.5 / force_torque.DIVISORS[group]
    assert all(abs(a - b) <= half for a, b in zip(values, back[:3], strict=True))


@pytest.mark.parametrize("value", [128.0, -128.01, math.nan, math.inf])
def test_a_force_that_the_sensor_cannot_say_is_refused_with_its_unit(value: float) -> None:
    with pytest.raises(ValueRangeError, match=r"force y = .* N is outside \[-128"):
        pack_reading(Group.FORCE, (0.0, value, 0.0))


def test_the_pendant_of_the_protocol_is_read() -> None:
    calm = Pendant(Button.NONE, False, True, 0x3F, Level.SAFE, Level.SAFE, Level.SAFE, Level.SAFE, Level.SAFE)
    assert decode_pendant(0x0D3F1249) == calm
    assert decode_pendant(0x0D791849) == calm._replace(display=0x79, heartbeat=Level.FAULT)


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
def test_a_pendant_comes_back_through_a_property(pendant: Pendant) -> None:
    value = decode_value(encode_value(SAFETY["PEN"], encode_pendant(pendant))).value
    assert decode_pendant(value) == pendant


@given(st.integers(-(2**31), 2**31 - 1))
def test_every_pendant_value_decodes_or_names_what_is_wrong(value: int) -> None:
    fields = [value >> shift & 7 for shift in (12, 9, 6, 3, 0)]
    if all(field in (1, 2, 4) for field in fields):
        assert decode_pendant(value).velocity == fields[-1]
    else:
        with pytest.raises(FrameError, match="not one of 001, 010, 100"):
            decode_pendant(value)


def test_a_mode_that_does_not_exist_is_refused() -> None:
    assert [decode_mode(k) for k in range(3)] == [Mode.ESTOP, Mode.IDLE, Mode.ACTIVE]
    with pytest.raises(FrameError, match="MODE 3"):
        decode_mode(3)


@pytest.mark.parametrize(
    ("version", "expected"),
    [
        (61, {"MECH": 63, "CTS": 65, "PIDX": 67, "TSTOP": 75, "IPNM": 83, "ECMAX": 91, "ECMIN": 92}),
        (64, {"MECH": 64, "CTS": 66, "PIDX": 68, "TSTOP": 75, "IPNM": 83, "ECMAX": 91}),
        (113, {"V": 44}),
        (114, {"V": 106, "VCMD": 44}),
        (118, {"V": 106, "VCMD": 44}),
        (119, {"V": 44}),
        (124, {"MECH": 66, "CTS": 68, "TSTOP": 78, "IPNM": 86, "ECMAX": 96, "ECMIN": 97, "HOLD": 94}),
        (125, {"ECMAX": 100, "ECMIN": 101, "HOLD": 94, "JP": 96, "JOFST": 98}),
        (132, {"ECMAX": 101, "ECMIN": 102, "HOLD": 77}),
        (200, {"T": 42, "P": 48, "MECH": 66, "CTS": 68, "IPNM": 86, "JOFST": 98, "IHIT": 108}),
    ],
)
def test_motor_properties_have_the_numbers_of_their_firmware(version: int, expected: dict[str, int]) -> None:
    table = properties(Kind.MOTOR, version)
    assert {name: table[name] for name in expected} == expected


def test_nodes_answer_the_same_numbers_before_and_after_their_firmware_starts() -> None:
    for table in (MOTOR, SAFETY, FORCE):
        assert all(table[name] == MONITOR[name] for name in ("VERS", "ROLE", "STAT"))


@pytest.mark.parametrize(
    "table", [MOTOR, SAFETY, FORCE, MONITOR, properties(Kind.MOTOR, 100), properties(Kind.MOTOR, 116)]
)
def test_no_two_properties_share_a_number(table: dict[str, int]) -> None:
    assert len(set(table.values())) == len(table)


def test_old_firmware_is_refused_by_its_version() -> None:
    with pytest.raises(MisfitError, match="firmware 60; 61 or later"):
        properties(Kind.MOTOR, 60)


def test_roles_tell_motors_safety_module_and_sensor() -> None:
    assert [kind_of(r) for r in (0x4100, 2, 6)] == [Kind.MOTOR, Kind.SAFETY, Kind.FORCE_SENSOR]
    with pytest.raises(FrameError, match="node of type 1"):
        kind_of(0x0101)


@given(DATA)
def test_any_bytes_decode_or_raise_the_documented_error(data: bytes) -> None:
    decoders = [
        decode_request,
        decode_value,
        unpack_torques,
        unpack_positions,
        motor_counts,
        lambda d: unpack_reading(Group.FORCE, d),
    ]
    for decode in decoders:
        try:
            decode(data)
        except FrameError as error:
            assert str(error)


@given(st.integers(0, 0x7FF), DATA)
def test_a_frame_survives_the_notation_of_candump(identifier: int, payload: bytes) -> None:
    frame = Frame(identifier, payload)
    assert parse_frame(str(frame)) == frame


@pytest.mark.parametrize("text", ["", "401", "800#00", "1#001122334455667788", "x#00", "401#0"])
def test_text_that_is_no_frame_is_refused(text: str) -> None:
    with pytest.raises(FrameError, match="CAN frame"):
        parse_frame(text)
