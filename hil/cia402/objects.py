"""The objects of a drive that a session uses, by the profile CiA 402 (and CiA 301 for how it talks), as the `canopen`
library takes them."""

from canopen import ObjectDictionary
from canopen.objectdictionary import ODRecord, ODVariable, datatypes

DEVICE_TYPE, ERROR_CODE, CONTROLWORD, STATUSWORD, ABORT_CONNECTION = 0x1000, 0x603F, 0x6040, 0x6041, 0x6007
MODE, MODE_SHOWN, POSITION, TORQUE, TORQUE_SHOWN = 0x6060, 0x6061, 0x6064, 0x6071, 0x6077
MOST_TORQUE, RATED_TORQUE, SUPPORTED_MODES = 0x6072, 0x6076, 0x6502
ENCODER = 0x608F
COMMAND, STATUS = 1, 1  # numbers of the PDOs
EVENT_TIMER = 5  # entry of an RPDO's communication record: ms without a command after which the drive reacts
# Low half of the device type.
PROFILE = 402
CYCLIC_TORQUE = 10
# Bit of that mode among the supported ones.
CYCLIC_TORQUE_BIT = 1 << 9
# Reaction to lost commands: the power stage goes off.
DISABLE_VOLTAGE = 2

_U8, _U16, _U32 = datatypes.UNSIGNED8, datatypes.UNSIGNED16, datatypes.UNSIGNED32
_I8, _I16, _I32 = datatypes.INTEGER8, datatypes.INTEGER16, datatypes.INTEGER32
# Index -> name, type, access.
_VARIABLES = {
    DEVICE_TYPE: ("Device type", _U32, "ro"),
    ABORT_CONNECTION: ("Abort connection option code", _I16, "rw"),
    ERROR_CODE: ("Error code", _U16, "ro"),
    CONTROLWORD: ("Controlword", _U16, "rw"),
    STATUSWORD: ("Statusword", _U16, "ro"),
    MODE: ("Modes of operation", _I8, "rw"),
    MODE_SHOWN: ("Modes of operation display", _I8, "ro"),
    POSITION: ("Position actual value", _I32, "ro"),
    TORQUE: ("Target torque", _I16, "rw"),
    MOST_TORQUE: ("Max torque", _U16, "rw"),
    RATED_TORQUE: ("Motor rated torque", _U32, "rw"),
    TORQUE_SHOWN: ("Torque actual value", _I16, "ro"),
    SUPPORTED_MODES: ("Supported drive modes", _U32, "ro"),
}
_MAPPED = 8


def object_dictionary() -> ObjectDictionary:
    """Those objects, without a manufacturer's own."""
    found = ObjectDictionary()  # type: ignore[no-untyped-call]  # the library has no complete types
    for index, (name, kind, access) in _VARIABLES.items():
        found.add_object(_variable(name, index, 0, kind, access))
    found.add_object(_record("Position encoder resolution", ENCODER, [("Increments", _U32), ("Revolutions", _U32)]))
    for receives, talk, mapping in ((True, 0x1400, 0x1600), (False, 0x1800, 0x1A00)):
        entries = [("COB-ID", _U32), ("Transmission type", _U8), ("Inhibit time", _U16)]
        entries += [("Reserved", _U8), ("Event timer", _U16)]
        way = "RPDO" if receives else "TPDO"
        found.add_object(_record(f"{way}1 communication", talk, entries))
        found.add_object(_record(f"{way}1 mapping", mapping, [(f"Object {k}", _U32) for k in range(1, _MAPPED + 1)]))
    return found


def _variable(name: str, index: int, subindex: int, kind: int, access: str) -> ODVariable:
    found = ODVariable(name, index, subindex)
    found.data_type, found.access_type = kind, access
    return found


def _record(name: str, index: int, entries: list[tuple[str, int]]) -> ODRecord:
    found = ODRecord(name, index)
    found.add_member(_variable("Number of entries", index, 0, _U8, "rw"))
    for place, (entry, kind) in enumerate(entries, start=1):
        found.add_member(_variable(entry, index, place, kind, "rw"))
    return found
