"""Numbers of properties by name: they depend on the kind of node and, for motors, on its firmware.

Firmware before version 61 numbers its properties otherwise and is refused.
"""

from collections.abc import Mapping
from enum import Enum

from fmus.errors import MisfitError
from hil.errors import FrameError

OLDEST_FIRMWARE = 61
# From this version on the whole table of motors is known.
NEWEST_TABLE = 175

# A node whose firmware has not been started (STAT = 0) knows these only.
MONITOR = {
    "VERS": 0, "ROLE": 1, "SN": 2, "ID": 3, "ERROR": 4, "STAT": 5, "ADDR": 6, "VALUE": 7, "LOCK": 8, "SAVE": 9, "LOAD": 10,
}  # fmt: skip
_UNIVERSAL = {name: number for name, number in MONITOR.items() if number < 8}
_COMMON = _UNIVERSAL | {
    name: 8 + k
    for k, name in enumerate(
        [
            "MODE", "TEMP", "PTEMP", "OTEMP", "BAUD", "LOCK", "DIG0", "DIG1", "FET0", "FET1", "ANA0", "ANA1", "THERM",
            "VBUS", "IMOTOR", "VLOGIC", "ILOGIC", "SG", "GRPA", "GRPB", "GRPC", "CMD", "SAVE", "LOAD", "DEF", "FIND",
            "X0", "X1", "X2", "X3", "X4", "X5", "X6", "X7",
        ]
    )
}  # fmt: skip
# Motors of firmware 61 on: the same in all versions.
_MOTOR = _COMMON | {
    "T": 42, "MT": 43, "V": 44, "MV": 45, "MCV": 46, "MOV": 47, "P": 48, "DP": 50, "E": 52, "OT": 54, "CT": 56,
}  # fmt: skip
_MOTOR_NEW = _MOTOR | {
    "M": 58, "DS": 60, "MOFST": 61, "IOFST": 62, "UPSECS": 63, "OD": 64, "MDS": 65, "MECH": 66, "CTS": 68, "PIDX": 70,
    "HSG": 71, "LSG": 72, "IVEL": 73, "IOFF": 74, "MPE": 76, "HOLD": 77, "TSTOP": 78, "KP": 79, "KD": 80, "KI": 81,
    "ACCEL": 82, "TENST": 83, "TENSO": 84, "JIDX": 85, "IPNM": 86, "HALLS": 87, "HALLH": 88, "POLES": 90, "IKP": 91,
    "IKI": 92, "IKCOR": 93, "EN": 94, "JP": 96, "JOFST": 98, "TIE": 100, "ECMAX": 101, "ECMIN": 102, "LFLAGS": 103,
    "LCTC": 104, "LCVC": 105, "TACT": 106, "TACTID": 107, "IHIT": 108,
}  # fmt: skip
# What older firmware numbers otherwise: from that version on.
_MOTOR_OLD = (
    (61, {"MECH": 63, "CTS": 65, "PIDX": 67, "TSTOP": 75, "IPNM": 83, "ECMAX": 91, "ECMIN": 92}),
    (64, {"MECH": 64, "CTS": 66, "PIDX": 68}),
    (65, {"MECH": 66, "CTS": 68, "PIDX": 70, "TSTOP": 78, "IPNM": 86, "ECMAX": 96, "ECMIN": 97, "HOLD": 94}),
    # These five versions have a voltage command (VCMD) where all others have their velocity.
    (114, {"V": 106, "VCMD": 44}),
    (119, {"V": 44}),
    (125, {"ECMAX": 100, "ECMIN": 101, "JP": 96, "JOFST": 98}),
    (132, {"ECMAX": 101, "ECMIN": 102, "HOLD": 77}),
)
_SAFETY = _COMMON | {
    "ZERO": 42, "PEN": 43, "SAFE": 44, "VL1": 45, "VL2": 46, "TL1": 47, "TL2": 48, "VOLTL1": 49, "VOLTL2": 50,
    "VOLTH1": 51, "VOLTH2": 52, "PWR": 53, "MAXPWR": 54, "IFAULT": 55, "VNOM": 56,
}  # fmt: skip
_FORCE_SENSOR = _COMMON | {
    "SG1": 42, "SG2": 43, "SG3": 44, "SG4": 45, "SG5": 46, "SG6": 47, "FX": 48, "FY": 49, "FZ": 50, "TX": 51, "TY": 52,
    "TZ": 53, "FT": 54, "AX": 55, "AY": 56, "AZ": 57, "GM": 58, "OV": 59, "LED": 60, "T1": 61, "T2": 62, "T3": 63, "A": 64,
}  # fmt: skip


class Kind(Enum):
    """What a node is, by the low five bits of its ROLE."""

    MOTOR = "motor"
    SAFETY = "safety module"
    FORCE_SENSOR = "force/torque sensor"


_KINDS = {0: Kind.MOTOR, 3: Kind.MOTOR, 5: Kind.MOTOR, 2: Kind.SAFETY, 6: Kind.FORCE_SENSOR}
# An option in a motor's ROLE.
ABSOLUTE_ENCODER = 0x0100


def kind_of(role: int) -> Kind:
    """What a node is.

    Raises:
        FrameError: if the role is none that a session can use.
    """
    try:
        return _KINDS[role & 0x1F]
    except KeyError:
        raise FrameError(
            f"ROLE {role:#06x} is a node of type {role & 0x1F}; {sorted(_KINDS)} are known (motor, safety, force)"
        ) from None


def properties(kind: Kind, version: int) -> Mapping[str, int]:
    """Numbers of the properties of a node by name; `version` is its firmware (VERS), which a force sensor ignores.

    Raises:
        MisfitError: if the firmware is older than 61.

    Example:
        >>> properties(Kind.MOTOR, 200)["CTS"], properties(Kind.MOTOR, 63)["CTS"]
        (68, 65)
    """
    if kind is Kind.FORCE_SENSOR:
        return _FORCE_SENSOR
    if version < OLDEST_FIRMWARE:
        raise MisfitError(f"the {kind.value} has firmware {version}; {OLDEST_FIRMWARE} or later is needed")
    if kind is Kind.SAFETY:
        return _SAFETY
    if version >= NEWEST_TABLE:
        return _MOTOR_NEW
    found = dict(_MOTOR)
    for since, changes in _MOTOR_OLD:
        if version >= since:
            found |= changes
    if not 114 <= version < 119:
        found.pop("VCMD", None)
    return found
