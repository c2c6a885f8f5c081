"""Which arm is strapped to a virtual robot."""

import json
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field

from fmus.errors import MisfitError
from hil.emulation.planar import Placement


@dataclass(frozen=True)
class Body:
    """An arm by its model (built-in, or `FILE.mo:Class` with the ports of `arm`), its parameters, and how it lies.

    What the model has beyond the nominal arm, such as friction in a slot, is what a session should find out.
    """

    model: str = "arm"
    values: Mapping[str, float] = field(default_factory=dict)
    shoulder: float = Placement.shoulder

    def to_json(self) -> str:
        """One line of JSON."""
        return json.dumps(asdict(self))

    @staticmethod
    def from_json(text: str) -> "Body":
        """What `to_json` wrote."""
        return Body(**json.loads(text))


def parse_values(given: tuple[str, ...]) -> dict[str, float]:
    """Parameters from `NAME=NUMBER`.

    Raises:
        MisfitError: if one is written otherwise.
    """
    found = {}
    for each in given:
        name, equals, number = each.rpartition("=")
        try:
            found[name] = float(number)
        except ValueError:
            equals = ""
        if not equals:
            raise MisfitError(f"--set {each}: NAME=NUMBER was expected, such as jointTorque1.b[2]=0.4")
    return found
