"""Which arm is strapped to a virtual robot, or what its own joints are burdened with."""

import json
import math
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field, fields
from typing import Any

from fmus.errors import MisfitError
from hil.emulation.planar import Placement


@dataclass(frozen=True)
class Burden:
    """What joints without an arm on them have: viscous `friction` N.m.s/rad, `dry` friction N.m, a `payload` kg at the
    robot's end, a `delay` s of torques, `noise` rad of the encoders.

    Raises:
        MisfitError: if one of them is negative or no number, or there is no friction at all.
    """

    friction: float = 0.3
    dry: float = 0.0
    payload: float = 0.0
    delay: float = 0.0
    noise: float = 0.0

    def __post_init__(self) -> None:
        """Refuse what no joint has."""
        for field_ in fields(self):
            value = getattr(self, field_.name)
            if not (isinstance(value, int | float) and math.isfinite(value) and value >= 0):
                raise MisfitError(f"{field_.name} = {value!r} of a virtual body; a number of zero or more was expected")
        if not self.friction > 0:
            raise MisfitError(
                "friction = 0 N.m.s/rad of a virtual body; joints without any friction never come to rest"
            )

    @staticmethod
    def of(values: Mapping[str, Any]) -> "Burden":
        """From names and numbers.

        Raises:
            MisfitError: if there is no such name.
        """
        known = [each.name for each in fields(Burden)]
        for name in values:
            if name not in known:
                raise MisfitError(
                    f"a virtual body has no {name!r}; there are {', '.join(known)}, or the model of an arm"
                )
        return Burden(**values)


@dataclass(frozen=True)
class Body:
    """An arm by its model (built-in, or `FILE.mo:Class` with the ports of `arm`), its parameters, and how it lies.

    What the model has beyond the nominal arm, such as friction in a slot, is what a session should find out. With a
    `burden` there is no arm: the robot's own joints have it.
    """

    model: str = "arm"
    values: Mapping[str, float] = field(default_factory=dict)
    shoulder: float = Placement.shoulder
    burden: Burden | None = None

    def to_json(self) -> str:
        """One line of JSON."""
        return json.dumps(asdict(self))

    @staticmethod
    def from_json(text: str) -> "Body":
        """What `to_json` wrote."""
        document = json.loads(text)
        burden = document.pop("burden", None)
        return Body(**document, burden=None if burden is None else Burden.of(burden))


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
