"""Arrays of FMI 3.0 are as large as structural parameters say; values for these change the description before anything is checked."""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from orchestrator.cosim.component import Port
from orchestrator.cosim.fmu.description import FmuDescription, check_sizes
from orchestrator.cosim.system import Value
from orchestrator.cosim.values import port_value


def sized(description: FmuDescription, given: Mapping[str, Value]) -> FmuDescription:
    """The description of an FMU whose structural parameters have the values that are `given`, by name among others.

    An array of another size has no start value: that of the description no longer fits.

    Raises:
        MisfitError: if a value is none for its structural parameter, or an array would be too large.
    """
    structure = {port.name: port for port in description.ports if port.causality == "structuralParameter"}
    values = {name: int(port_value(port, given[name])) for name, port in structure.items() if name in given}
    if not values:
        return description
    sizes = {name: int(port.start or 0) for name, port in structure.items()} | values

    def resized(port: Port) -> Port:
        if port.name in values:
            return replace(port, start=values[port.name])
        parts = description.dimensions.get(port.name, port.shape)
        shape = tuple(part if isinstance(part, int) else sizes[part] for part in parts)
        if shape == port.shape:
            return port
        check_sizes(port.name, shape)
        return replace(port, shape=shape, start=port.start if np.ndim(port.start) == 0 else None)

    return replace(description, ports=tuple(map(resized, description.ports)))
