"""From the name of a variable to the elements that it stands for: a scalar, an array, or one element of it."""

import re
from collections.abc import Mapping
from dataclasses import dataclass
from math import prod

from fmus.errors import MisfitError
from orchestrator.cosim.component import Port
from orchestrator.measurements.wording import nearest

_ELEMENT = re.compile(r"(?P<base>.+)\[(?P<indices>\d+(,\d+)*)\]")


@dataclass(frozen=True, eq=False)
class Element:
    """One number (or other value) of a port; `index` counts through the array from 0, row by row."""

    port: Port
    index: int

    @property
    def name(self) -> str:
        """Name within the component, such as `q[2]`."""
        return self.port.elements[self.index] if self.port.shape else self.port.name


def resolve(ports: Mapping[str, Port], variable: str, component: str) -> list[Element]:
    """List the elements that a variable's name stands for.

    A name is a port, an element `x[k]` (counted through from 1) or `x[i,j]` of an array, or the common name of scalar
    ports `x[1]`, `x[2]`, ... as FMI 2 has them for an array.

    Args:
        ports: the ports of the component, by name.
        variable: the name.
        component: name of the component, for messages.

    Raises:
        MisfitError: if there is no such variable or element; the message names the nearest.
    """
    if variable in ports:
        port = ports[variable]
        return [Element(port, k) for k in range(port.size)]
    match = _ELEMENT.fullmatch(variable)
    if match and match["base"] in ports:
        port = ports[match["base"]]
        return [Element(port, _index(port, match["indices"], component))]
    scalars = _scalars(ports, variable)
    if not scalars:
        raise MisfitError(f"{component} has no variable {variable!r}; {nearest(variable, ports)}")
    return scalars


def _index(port: Port, text: str, component: str) -> int:
    indices = [int(part) for part in text.split(",")]
    sizes = (port.size,) if len(indices) == 1 else port.shape
    if (
        not port.shape
        or len(indices) != len(sizes)
        or any(not 1 <= i <= n for i, n in zip(indices, sizes, strict=True))
    ):
        raise MisfitError(
            f"{component}.{port.name} has shape {port.shape}; there is no element [{text}], counted from 1"
        )
    return sum((i - 1) * prod(sizes[k + 1 :]) for k, i in enumerate(indices))


def _scalars(ports: Mapping[str, Port], base: str) -> list[Element]:
    found: dict[tuple[int, ...], Port] = {}
    for name, port in ports.items():
        if name.startswith(f"{base}[") and not port.shape:
            match = _ELEMENT.fullmatch(name)
            if match and match["base"] == base:
                found[tuple(int(part) for part in match["indices"].split(","))] = port
    return [Element(found[indices], 0) for indices in sorted(found)]
