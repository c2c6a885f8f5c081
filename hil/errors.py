"""What can go wrong at the bench."""

from fmus.errors import ComponentError, MisfitError


class FrameError(MisfitError):
    """Bytes on the bus that mean nothing here, for example a position of four bytes."""


class ValueRangeError(MisfitError):
    """A value that a frame cannot carry, for example a torque of 9000 in 14 bits; nothing is clipped."""


class BusError(ComponentError):
    """A bus that broke while in use, for example an adapter that was unplugged. Silence on a bus is no error."""
