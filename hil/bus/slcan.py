"""A client for serial CAN adapters (slcan) that reads all that waits at once; python-can's reads one byte at a time."""

import contextlib
import os
import select
import time

import can
import serial

from fmus.errors import MisfitError
from hil.bus.messages import NO_HANDLE
from hil.bus.text_bus import TextBus
from hil.codecs.slcan import SLCAN

# Some adapters answer no commands at all.
ANSWER_S = 0.2
_READ_BYTES = 65536
_BEFORE = b"\rO\r"
_RATES = {
    10_000: "S0", 20_000: "S1", 50_000: "S2", 100_000: "S3", 125_000: "S4", 250_000: "S5", 500_000: "S6", 800_000: "S7",
    1_000_000: "S8",
}  # fmt: skip


class SerialLine:
    """A serial port that never waits.

    Args:
        path: of its device; `path@BAUD` says the speed, too.
    """

    def __init__(self, path: str, baud: int) -> None:
        """Open it.

        Raises:
            OSError: if that is not possible.
        """
        path, _, speed = path.partition("@")
        self.name = f"serial adapter at {path}"
        self._port = serial.Serial(path, int(speed or baud), timeout=0)
        # Chips of FTDI keep what comes for 16 ms otherwise; others do not know this.
        with contextlib.suppress(OSError, ValueError, NotImplementedError):
            self._port.set_low_latency_mode(True)

    def fileno(self) -> int:
        """The port's."""
        return int(self._port.fileno())

    def read(self) -> bytes:
        """What has come."""
        return os.read(self.fileno(), _READ_BYTES)

    def write(self, data: bytes) -> int:
        """Send what the port takes at once."""
        try:
            return os.write(self.fileno(), data)
        except BlockingIOError:
            return 0

    def close(self) -> None:
        """Close it."""
        self._port.close()


class SlcanVoice(TextBus):
    """Sends through an adapter that another program has opened or will open, and hears nothing: two readers would take
    each other's frames. A watchdog's way to the bus: it works after that program has closed the bus, or was killed
    within a line.
    """

    def __init__(self, channel: str) -> None:
        """Open it.

        Raises:
            MisfitError: if there is no such device.
        """
        try:
            line = VoiceLine(channel)
        except OSError as error:
            raise MisfitError(f"serial adapter at {channel} cannot be opened: {error}") from error
        super().__init__(line, SLCAN, channel)

    def handle(self) -> int:
        """None: what the other reader is sent is no news here."""
        return NO_HANDLE

    def _fill(self, timeout_s: float | None) -> bool:
        time.sleep(timeout_s or 0.0)
        return False


class VoiceLine:
    """The way to a serial adapter without the way back."""

    def __init__(self, path: str) -> None:
        """Open it.

        Raises:
            OSError: if that is not possible.
        """
        path = path.partition("@")[0]
        self.name = f"serial adapter at {path}"
        self._device = os.open(path, os.O_WRONLY | os.O_NOCTTY | os.O_NONBLOCK)

    def fileno(self) -> int:
        """The device's."""
        return self._device

    def read(self) -> bytes:
        """Nothing comes this way."""
        return b""

    def write(self, data: bytes) -> int:
        """Send at once what the device takes; before it, what ends a line that is not whole and opens a bus that is closed."""
        try:
            return max(os.write(self._device, _BEFORE + data) - len(_BEFORE), 0)
        except BlockingIOError:
            return 0

    def close(self) -> None:
        """Close it."""
        os.close(self._device)


class SlcanBus(TextBus):
    """A bus behind a serial adapter.

    Args:
        channel: path of the device, such as /dev/ttyACM0.
        bitrate: of the bus in bit/s; the adapter's own without it.
        tty_baudrate: of the serial port; adapters on USB have none.
        sleep_after_open: s that an adapter needs which starts anew when it is opened.
    """

    def __init__(
        self,
        channel: str,
        bitrate: int | None = None,
        tty_baudrate: int = 115_200,
        can_filters: can.typechecking.CanFilters | None = None,
        *,
        sleep_after_open: float = 0.0,
    ) -> None:
        """Open adapter and bus.

        Raises:
            MisfitError: if there is no such device, no such bit rate, or the adapter refuses.
        """
        if bitrate is not None and bitrate not in _RATES:
            raise MisfitError(f"slcan knows no bit rate of {bitrate} bit/s; there are {', '.join(map(str, _RATES))}")
        try:
            line = SerialLine(channel, tty_baudrate)
        except (OSError, ValueError) as error:
            raise MisfitError(f"serial adapter at {channel} cannot be opened: {error}") from error
        super().__init__(line, SLCAN, channel, can_filters)
        try:
            time.sleep(sleep_after_open)
            self._command("C")  # refused by an adapter that is closed
            for command in ([_RATES[bitrate]] if bitrate is not None else []) + ["O"]:
                if self._command(command) == b"\a":
                    raise MisfitError(f"{line.name} refuses {command!r}; is its bus in use, or its bit rate fixed?")
        except (can.CanError, OSError) as error:
            self.shutdown()
            raise MisfitError(f"{line.name} was lost while it was opened: {error}") from error
        except BaseException:
            self.shutdown()
            raise

    def shutdown(self) -> None:
        """Leave the bus, and close the port."""
        if not self._is_shutdown:
            with contextlib.suppress(OSError):
                self._line.write(b"C\r")
        super().shutdown()

    def _command(self, command: str) -> bytes:
        """Give one; returns the answer's last byte, nothing if the adapter does not answer. Frames of before are dropped."""
        self._line.write(command.encode() + b"\r")
        end, said = time.monotonic() + ANSWER_S, b""
        while (left := end - time.monotonic()) > 0:
            if select.select([self._line.fileno()], [], [], left)[0]:
                said += self._line.read()
                # An answer is an end of a line without a line.
                for answer in (b"\r", b"\a"):
                    if said == answer or said.endswith((b"\r" + answer, b"\a" + answer)):
                        return answer
        return b""
