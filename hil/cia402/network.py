"""The `canopen` library on a wire of ours: it asks, and what comes until the answer is handed to it at once, without a
thread."""

from canopen import Network, RemoteNode
from canopen.sdo.base import SdoVariable
from canopen.sdo.exceptions import SdoAbortedError, SdoCommunicationError

from hil.cia402.objects import object_dictionary
from hil.codecs.frame import Frame
from hil.errors import BusError
from hil.robots.base import Line

# A drive answers a question within so long.
ANSWER_S = 0.1
_REQUESTS, _ANSWERS = 0x600, 0x580


class WireNetwork(Network):  # type: ignore[misc]  # the library has no complete types
    """A network whose frames go over a `Line`."""

    def __init__(self, line: Line) -> None:
        super().__init__()
        self.line = line

    def send_message(self, can_id: int, data: bytes, remote: bool = False) -> None:
        """Send; after a question wait for its answer."""
        if remote:
            return
        self.line.send(Frame(can_id, bytes(data)))
        if _REQUESTS < can_id <= _REQUESTS + 0x7F:
            self._hear(can_id - _REQUESTS + _ANSWERS)

    def _hear(self, awaited: int) -> None:
        """Hand on what comes until the awaited frame was among it, or its time is over."""
        deadline = self.line.now() + int(ANSWER_S * 1e9)
        while (left := (deadline - self.line.now()) * 1e-9) > 0:
            timed = self.line.receive(left)
            if timed is None:
                return
            self.notify(timed.frame.identifier, bytearray(timed.frame.data), timed.time_ns * 1e-9)
            if timed.frame.identifier == awaited:
                return


class Drive:
    """One drive's objects, read and written by index."""

    def __init__(self, network: WireNetwork, number: int) -> None:
        self.number, self.name = number, network.line.name
        self.node: RemoteNode = network.add_node(RemoteNode(number, object_dictionary()))
        # Whoever waits is `WireNetwork`, which has handed the answer on before the library looks for it.
        self.node.sdo.RESPONSE_TIMEOUT = 0.001

    def read(self, index: int, subindex: int = 0) -> int:
        """A value.

        Raises:
            BusError: if the drive does not answer, or has no such object.
        """
        try:
            return int(self._entry(index, subindex).raw)
        except (SdoAbortedError, SdoCommunicationError) as error:
            raise BusError(f"{self.name}: drive {self.number}, object {index:#06x}:{subindex}: {error}") from error

    def _entry(self, index: int, subindex: int) -> SdoVariable:
        found = self.node.sdo[index]
        return found if isinstance(found, SdoVariable) else found[subindex]

    def write(self, index: int, value: int, subindex: int = 0) -> None:
        """Set a value.

        Raises:
            BusError: if the drive does not answer, or does not take it.
        """
        try:
            self._entry(index, subindex).raw = value
        except (SdoAbortedError, SdoCommunicationError) as error:
            raise BusError(
                f"{self.name}: drive {self.number} does not take {value} for object {index:#06x}:{subindex}: {error}"
            ) from error
