"""What an FMU shows of itself: inputs, outputs and states as scalars, whatever FMI version it speaks."""

import math
from dataclasses import dataclass
from itertools import product
from typing import Any

from fmus.errors import FmuError
from fmus.symbolic.system import Variable

REAL = ("Real", "Float64")
# Units of forces, with the unit of what each of them moves.
FORCE_UNITS = {"N.m": "rad", "N": "m", "kg.m2/s2": "rad", "kg.m/s2": "m"}


@dataclass(frozen=True)
class Port:
    """One scalar of a variable: value reference, and its place among the `size` elements of an array."""

    variable: Variable
    reference: int
    place: int = 0
    size: int = 1

    @property
    def name(self) -> str:
        """Name of the scalar, such as `q[2]`."""
        return self.variable.name


@dataclass(frozen=True)
class Description:
    """The parts of a model description that matter here; `states` and `rates` belong together, in the FMU's order.

    `settable` are the states whose start values can be set before the run. `speed_of` maps an output's name to a
    variable that is declared as its derivative. `directional` tells whether directional derivatives can be asked for.
    `parameters` are scalars with a start value that can be set before a run.
    """

    name: str
    version: int
    cosimulation: bool
    inputs: tuple[Port, ...]
    outputs: tuple[Port, ...]
    states: tuple[Port, ...]
    rates: tuple[Port, ...]
    settable: tuple[Port, ...]
    speed_of: dict[str, Port]
    directional: bool
    parameters: tuple[Port, ...] = ()


def describe(description: Any, name: str) -> Description:
    """Read a model description of fmpy.

    Model exchange is preferred, as it tells more; an FMU that has events or only co-simulation is stepped.

    Raises:
        FmuError: if the FMU can neither be stepped nor integrated without events.
    """
    if description.fmiVersion not in ("2.0", "3.0"):
        raise FmuError(f"FMU {name} is FMI {description.fmiVersion}; FMI 2.0 and 3.0 can be run")
    exchange, stepped = description.modelExchange, description.coSimulation
    exchangeable = exchange is not None and not description.numberOfEventIndicators
    if not exchangeable and stepped is None:
        kind = "model exchange with events" if exchange is not None else "scheduled execution"
        raise FmuError(f"FMU {name} offers only {kind}; export it for co-simulation, or without events")
    variables = [v for v in description.modelVariables if v.type in REAL]
    derivatives = [u.variable for u in description.derivatives]
    states = [v.derivative for v in derivatives if v.derivative is not None]
    of_state = {id(v.derivative): v for v in variables if v.derivative is not None}
    outputs = [v for v in variables if v.causality == "output"]
    return Description(
        name=name,
        version=int(description.fmiVersion[0]),
        cosimulation=not exchangeable,
        inputs=_ports(v for v in variables if v.causality == "input"),
        outputs=_ports(outputs),
        states=_ports(states),
        rates=_ports(derivatives),
        settable=_ports(v for v in states if v.initial in ("exact", "approx")),
        speed_of={
            one.name: other
            for v in outputs
            if id(v) in of_state
            for one, other in zip(_ports([v]), _ports([of_state[id(v)]]), strict=True)
        },
        directional=bool(exchangeable and getattr(exchange, "providesDirectionalDerivative", False)),
        parameters=tuple(p for p in _ports(v for v in variables if v.causality == "parameter") if p.size == 1),
    )


def _ports(variables: Any) -> tuple[Port, ...]:
    found: list[Port] = []
    for scalar in variables:
        lengths = [_length(d) for d in scalar.dimensions or ()]
        size = math.prod(lengths)
        starts = _numbers(scalar.start, size)
        for place, index in enumerate(product(*(range(1, n + 1) for n in lengths))):
            label = f"{scalar.name}[{','.join(map(str, index))}]" if index else scalar.name
            found.append(Port(_variable(scalar, label, starts[place]), scalar.valueReference, place, size))
    return tuple(found)


def _length(dimension: Any) -> int:
    if dimension.start is None:
        raise FmuError("an array whose size depends on a parameter cannot be run yet; export it with a fixed size")
    return int(dimension.start)


def _numbers(text: Any, size: int) -> list[float | None]:
    if text is None:
        return [None] * size
    values = [number(part) for part in str(text).split()]
    return values * size if len(values) == 1 else values


def _variable(scalar: Any, name: str, start: float | None) -> Variable:
    declared = scalar.declaredType
    unit = scalar.unit or (declared.unit if declared is not None else None) or ""
    return Variable(
        name=name,
        unit=unit,
        description=scalar.description or "",
        start=start,
        minimum=number(scalar.min),
        maximum=number(scalar.max),
        nominal=number(scalar.nominal),
    )


def number(text: Any) -> float | None:
    """A finite number from a description's text, else None."""
    try:
        value = float(text)
    except (TypeError, ValueError):
        return None
    return value if math.isfinite(value) else None
