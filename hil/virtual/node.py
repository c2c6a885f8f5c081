"""A node of a virtual robot: properties that can be read and set, asleep until its firmware is started."""

from collections.abc import Iterable

from hil.codecs.barrett.identifiers import Address, Group, answer_of
from hil.codecs.barrett.properties import decode_value, encode_value
from hil.codecs.barrett.tables import MONITOR, Kind, properties
from hil.codecs.frame import Frame, Timed
from hil.errors import FrameError

ASLEEP, AWAKE = 0, 2
# Firmware of a node unless something else is said.
VERSION = 200
_ROLES = {Kind.MOTOR: 0x4100 & ~0x4000, Kind.SAFETY: 2, Kind.FORCE_SENSOR: 6}
# Answers within a millisecond are needed to be found on the bus; a real frame takes 75 us.
ANSWER_NS = 75_000
# A node that restarts is off the bus for so long.
WAKING_NS = 5_000_000


class Node:
    """A node by its number; `groups` are those whose requests it follows."""

    def __init__(self, number: int, kind: Kind, groups: Iterable[Group], version: int = VERSION) -> None:
        self.number, self.kind, self.groups = number, kind, frozenset(groups)
        self.numbers = properties(kind, version)
        self.names = {number: name for name, number in self.numbers.items()}
        self.values: dict[str, int] = dict.fromkeys(self.numbers, 0)
        self.values |= {"VERS": version, "ROLE": _ROLES[kind], "ID": number, "SN": 1000 + number, "STAT": ASLEEP}
        self.stored = dict(self.values)
        self.silent_until_ns = 0
        # Somebody pulled the plug.
        self.powered = True

    @property
    def is_awake(self) -> bool:
        """Whether its firmware runs."""
        return self.values["STAT"] == AWAKE

    def hears(self, address: Address) -> bool:
        """Whether a frame from the host concerns this node."""
        if not self.powered or address.sender != 0:
            return False
        return self.belongs_to(address.receiver) if address.to_group else address.receiver == self.number

    def belongs_to(self, group: int) -> bool:
        """Whether it follows what is said to a group of nodes."""
        return group in self.groups

    def receive(self, data: bytes, time_ns: int) -> list[Timed]:
        """Follow a request or a setting; what it does not understand it ignores, as a controller does."""
        if time_ns < self.silent_until_ns or not data:
            return []
        if len(data) == 1 and not data[0] & 0x80:
            return self._asked(data[0], time_ns)
        try:
            number, value = decode_value(data)
        except FrameError:
            return []
        known = self.names if self.is_awake else {n: name for name, n in MONITOR.items()}
        if number in known:
            self._set(known[number], value, time_ns)
        return []

    def _asked(self, number: int, time_ns: int) -> list[Timed]:
        known = self.names if self.is_awake else {n: name for name, n in MONITOR.items()}
        if number not in known:
            return []
        data = encode_value(number, self._read(known[number], time_ns), 4)
        return [Timed(time_ns + ANSWER_NS, Frame(answer_of(self.number, Group.PROPERTIES), data))]

    def _read(self, name: str, time_ns: int) -> int:
        return self.values.get(name, 0)

    def _set(self, name: str, value: int, time_ns: int) -> None:
        if name == "STAT":
            if value == AWAKE and not self.is_awake:
                self.silent_until_ns = time_ns + WAKING_NS
            self.values["STAT"] = AWAKE if value == AWAKE else ASLEEP
        elif name == "SAVE":
            for saved in self.names.values() if value == -1 else [self.names.get(value, "")]:
                self.stored[saved] = self.values.get(saved, 0)
        elif name == "LOAD":
            loaded = self.names.get(value, "")
            self.values[loaded] = self.stored.get(loaded, 0)
        elif name not in ("VERS", "ROLE", "SN", "DEF"):
            self.values[name] = value
