"""The one way of a torque to the bus: from the safety core's outcome."""

from collections.abc import Sequence
from typing import Final

from hil.codecs.barrett.identifiers import Group, to_group
from hil.codecs.barrett.properties import encode_value
from hil.codecs.barrett.torques import pack_torques, saturated
from hil.codecs.frame import Frame
from hil.robots import proficio
from hil.safety.cycle import Outcome

TORQUES: Final = to_group(Group.LOWER_TORQUES)
# The same in all firmware since version 61.
MODE_PROPERTY: Final = 8
TORQUE_IDENTIFIERS: Final = frozenset({TORQUES, to_group(Group.UPPER_TORQUES)})


class TorqueGate:
    """Turns outcomes of the safety core into frames; torque frames are made here and nowhere else.

    Args:
        torque_units: units of each motor's controller per N.m (IPNM).
        mode_property: number of the property MODE.
    """

    def __init__(self, torque_units: Sequence[float], mode_property: int) -> None:
        one, two, three = map(float, torque_units)
        self._units: proficio.Vector = (one, two, three)
        self._mode = mode_property

    def frames(self, outcome: Outcome) -> list[Frame]:
        """The frames that an outcome allows."""
        if outcome.torques is None:
            return []
        one, two, three = outcome.torques
        first, second, third = proficio.times(proficio.TORQUES_AT_MOTORS, (one, two, three))
        units = self._units
        sent = [Frame(TORQUES, pack_torques(saturated([units[0] * first, units[1] * second, units[2] * third])))]
        return [*sent, _idle(self._mode)] if outcome.to_idle else sent


def let_go(mode_property: int = MODE_PROPERTY) -> list[Frame]:
    """Frames that need no permission: no torque, and motors to idle, where they brake by themselves."""
    return [Frame(TORQUES, pack_torques([])), _idle(mode_property)]


def _idle(mode_property: int) -> Frame:
    return Frame(to_group(Group.ARM), encode_value(mode_property, 0))
