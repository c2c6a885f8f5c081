"""What goes over a wire to a Proficio, and what must come back: the same bytes whatever carries them.

After the answers to a question the safety module is asked for its serial number; what comes before its answer was too much. So
nothing is waited for that should not come; what comes even later is too much for the next question.
"""

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import can

from hil.codecs.frame import Frame, parse_frame

LAST_WORD, LAST_ANSWER = parse_frame("00A#02"), parse_frame("546#8200F2030000")
PATIENCE_S = 10.0


@dataclass(frozen=True)
class Exchange:
    """A question in candump's notation, and all that must come back, in any order; `patient` where a node may be restarting."""

    words: str
    question: str
    answers: tuple[str, ...] = ()
    patient: bool = False


EXCHANGES = (
    Exchange("a node that sleeps says so", "001#05", ("426#850000000000",)),
    Exchange("it knows what it is", "001#01", ("426#810000010000",)),
    Exchange("and its firmware", "001#00", ("426#8000C8000000",)),
    Exchange("but nothing that needs it", "001#44"),
    Exchange("nobody is where nobody is", "004#05"),
    Exchange("motor 1 is woken", "001#850002000000"),
    Exchange("motor 2 is woken", "002#850002000000"),
    Exchange("motor 3 is woken by a short setting", "003#85000200"),
    Exchange("the sensor is woken", "008#850002000000"),
    Exchange("motor 1 is awake", "001#05", ("426#850002000000",), patient=True),
    Exchange("motor 2 is awake", "002#05", ("446#850002000000",), patient=True),
    Exchange("motor 3 is awake", "003#05", ("466#850002000000",), patient=True),
    Exchange("the sensor is awake", "008#05", ("506#850002000000",), patient=True),
    Exchange("counts a turn", "001#44", ("426#C40000100000",)),
    Exchange("units per N.m", "002#56", ("446#D6008C0A0000",)),
    Exchange("a position is defined", "001#B000E8030000"),
    Exchange("a negative one", "002#B00018FCFFFF"),
    Exchange("a zero", "003#B00000000000"),
    Exchange("all positions", "404#30", ("423#0003E8", "443#3FFC18", "463#000000")),
    Exchange("the same", "404#30", ("423#0003E8", "443#3FFC18", "463#000000")),
    Exchange("a group's settings are not answered", "404#880000000000"),
    Exchange("a torque frame is not answered", "401#AA0004002000C004"),
    Exchange("a torque that is idle does not move the arm", "404#30", ("423#0003E8", "443#3FFC18", "463#000000")),
    Exchange("the module is idle", "00A#08", ("546#880001000000",)),
    Exchange("the host cannot make it active", "00A#880002000000"),
    Exchange("it is still idle", "00A#08", ("546#880001000000",)),
    Exchange("its pendant", "00A#2B", ("546#AB0049123F0D",)),
    Exchange("a limit of speed is set", "00A#AE0000180000"),
    Exchange("and is said", "00A#2E", ("546#AE0000180000",)),
    Exchange("the byte of a torque frame means something else to it", "00A#AA0001000000"),
    Exchange("the arm is zeroed", "00A#2A", ("546#AA0001000000",)),
    Exchange("an acceleration", "008#40", ("50C#00000000C6D8",)),
    Exchange("a frame without data", "001#"),
    Exchange("a setting cut short", "001#88"),
    Exchange("one of the wrong length", "001#8800020000"),
    Exchange("a torque frame of the wrong length", "401#AA00040020"),
    Exchange("a torque frame of another property", "401#FB0004002000C004"),
    Exchange("an identifier that is nobody's", "7FF#0102030405060708"),
    Exchange("a node that pretends to be one", "423#0003E8"),
    Exchange("a property that there is none", "001#7F"),
    Exchange("all is as it was", "404#30", ("423#0003E8", "443#3FFC18", "463#000000")),
)
# What a Barrett bus never carries: questions for a STAT, were they taken for ordinary frames.
ODD_MESSAGES = (
    can.Message(arbitration_id=0x001, is_extended_id=False, is_remote_frame=True, dlc=1),
    can.Message(arbitration_id=0x00000001, is_extended_id=True, data=b"\x05"),
    can.Message(arbitration_id=0x001, is_extended_id=False, is_fd=True, data=b"\x05" + bytes(11)),
)


def wrong_answers(
    send: Callable[[Frame], None], receive: Callable[[float], Frame | None], exchanges: Sequence[Exchange] = EXCHANGES
) -> list[str]:
    """Have all exchanges; returns those whose answers were others, in words.

    Args:
        receive: waits that many seconds at most.
    """
    found = []
    for exchange in exchanges:
        answers = _answers(exchange, send, receive)
        if sorted(map(str, answers)) != sorted(exchange.answers):
            found.append(f"{exchange.words}: {exchange.question} -> {' '.join(map(str, answers)) or 'nothing'}")
    return found


def answers_to_odd_messages(bus: can.BusABC) -> list[str]:
    """Send what the bus takes of messages that a Barrett bus never carries; returns what is answered, which must be nothing."""
    found = []
    for message in ODD_MESSAGES:
        try:
            bus.send(message)
        except can.CanError:  # refused before it is on the way, which is best
            continue
        found += _until_the_last_word(lambda frame: bus.send(message_of(frame)), lambda s: frame_of(bus.recv(s)))
    return [str(frame) for frame in found]


def message_of(frame: Frame) -> can.Message:
    """As python-can has it."""
    return can.Message(arbitration_id=frame.identifier, data=frame.data, is_extended_id=False)


def frame_of(message: can.Message | None) -> Frame | None:
    """As we have it."""
    return None if message is None else Frame(message.arbitration_id, bytes(message.data))


def _answers(
    exchange: Exchange, send: Callable[[Frame], None], receive: Callable[[float], Frame | None]
) -> list[Frame]:
    end = time.monotonic() + PATIENCE_S
    found: list[Frame] = []
    while not found and time.monotonic() < end:
        send(parse_frame(exchange.question))
        while not exchange.patient and len(found) < len(exchange.answers) and time.monotonic() < end:
            found += _one(receive(0.1))
        found += _until_the_last_word(send, receive)
        if not exchange.patient:
            break
    return found


def _until_the_last_word(send: Callable[[Frame], None], receive: Callable[[float], Frame | None]) -> list[Frame]:
    send(LAST_WORD)
    found: list[Frame] = []
    end = time.monotonic() + PATIENCE_S
    while time.monotonic() < end:
        frame = receive(0.1)
        if frame == LAST_ANSWER:
            return found
        found += _one(frame)
    raise TimeoutError(f"{LAST_WORD} was not answered within {PATIENCE_S:g} s")


def _one(frame: Frame | None) -> list[Frame]:
    return [] if frame is None else [frame]
