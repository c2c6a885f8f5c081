"""Inputs that nothing drives, and the values that they keep."""

from collections.abc import Container, Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from orchestrator.cosim.component import Port
from orchestrator.cosim.system import System, split_address
from orchestrator.cosim.wiring import OUTSIDE, Slot, Unconnected

Starts = Mapping[str, Mapping[str, Any]]


def unconnected_inputs(
    system: System, slots: Sequence[Slot], starts: Starts, driven: Container[int]
) -> Iterator[Unconnected]:
    """List inputs of the system, which a plain run leaves as they are, then free inputs or elements of components.

    Args:
        system: as described.
        slots: of the wiring.
        starts: values that are set before initialisation, by component and port.
        driven: numbers of the values that a link ends in.
    """
    for slot in slots:
        if slot.component == OUTSIDE and slot.port.causality == "output":
            component, variable = split_address(system.inputs[slot.port.name][0])
            given = variable in system.components[component].values
            value = _or_zero(slot.port, slot.port.start)
            yield Unconnected(f"input {slot.port.name}", value, slot.port.unit, given)
    for slot in slots:
        if slot.component != OUTSIDE and slot.port.causality == "input" and slot.port.type != "Clock":
            yield from _free(slot, starts[slot.component], driven)


def _free(slot: Slot, starts: Mapping[str, Any], driven: Container[int]) -> Iterator[Unconnected]:
    free = [k for k in range(slot.port.size) if slot.first + k not in driven]
    given = slot.port.name in starts
    value = starts.get(slot.port.name, slot.port.start)
    if free and len(free) == slot.port.size:
        yield Unconnected(slot.address, _or_zero(slot.port, value), slot.port.unit, given)
        return
    for k in free:
        element = _or_zero(replace(slot.port, shape=()), None if value is None else np.ravel(value)[k])
        yield Unconnected(f"{slot.component}.{slot.port.elements[k]}", element, slot.port.unit, given)


def _or_zero(port: Port, value: Any) -> Any:
    """The start value; where there is none what FMI takes for it, zero or empty."""
    if value is not None:
        return value
    zero: Any = {"Boolean": False, "String": "", "Binary": b""}.get(port.type, 0)
    return np.full(port.shape, zero) if port.shape else zero
