"""Error frames of adapters in words; their identifiers are those of SocketCAN, which other interfaces may not follow."""

import can

_CLASSES = {
    0x001: "a frame was not sent in time",
    0x002: "arbitration was lost",
    0x004: "the controller's state changed (warning or passive)",
    0x008: "a frame broke the protocol",
    0x010: "trouble of the transceiver: look at cable and terminators",
    0x020: "no node acknowledged a frame: is the robot on, and its bit rate 1 Mbit/s?",
    0x040: "bus off: the adapter has left the bus after too many errors; look at cable, terminators and bit rate",
    0x080: "an error on the bus",
    0x100: "the controller was restarted",
}


def words_of(message: can.Message) -> str:
    """What an error frame says.

    Example:
        >>> words_of(can.Message(arbitration_id=0x22, is_error_frame=True))
        'arbitration was lost; no node acknowledged a frame: is the robot on, and its bit rate 1 Mbit/s?'
    """
    found = [words for bit, words in _CLASSES.items() if message.arbitration_id & bit]
    return "; ".join(found) or f"error frame without a class, identifier {message.arbitration_id:#x}"
