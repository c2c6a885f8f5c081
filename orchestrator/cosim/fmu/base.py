"""What FMUs of all interfaces share as components: values, saved states, the life of a component."""

import weakref
from collections.abc import Sequence
from typing import Any

from fmus.errors import ComponentError
from orchestrator.cosim.component import Component, Port
from orchestrator.cosim.fmu.description import MODEL_EXCHANGE, FmuDescription, Interface
from orchestrator.cosim.fmu.instance import Access, Instance
from orchestrator.cosim.fmu.instance1 import ExchangeInstance1, Instance1
from orchestrator.cosim.fmu.instance2 import Instance2
from orchestrator.cosim.fmu.instance3 import Instance3

_alive: weakref.WeakValueDictionary[str, Instance] = weakref.WeakValueDictionary()


def instantiate(
    name: str,
    description: FmuDescription,
    interface: Interface,
    early_return: bool = False,
    kind: type[Instance] | None = None,
) -> Instance:
    """Instantiate an FMU, as the `kind` of instance that its version has, or another one.

    Args:
        name: what messages call it.
        description: what the FMU says of itself.
        interface: the way it is run.
        early_return: whether a step may end before it is over.
        kind: class of the instance; None for that of the FMU's version.

    Raises:
        ComponentError: if it refuses, or if it may only be there once in a process and already is.
    """
    key = f"{description.digest} {interface.identifier}"
    other = _alive.get(key)
    if interface.once_per_process and other is not None and other.component.value:
        raise ComponentError(
            f"FMU '{name}' can be instantiated only once per process and is already there as '{other.name}'; isolate one of them"
        )
    first = ExchangeInstance1 if interface.kind == MODEL_EXCHANGE else Instance1
    kinds: dict[int, type[Instance]] = {1: first, 2: Instance2, 3: Instance3}
    instance = (kind or kinds[description.version])(name, description, interface, early_return)
    _alive[key] = instance
    return instance


class Values:
    """Values of one instance by name; what a group of names needs is prepared once."""

    def __init__(self, instance: Instance) -> None:
        self.instance = instance
        self._reads: dict[tuple[str, ...], list[tuple[Access, list[int]]]] = {}
        self._writes: dict[tuple[str, ...], list[tuple[Access, list[int]]]] = {}

    def set(self, names: Sequence[str], values: Sequence[Any]) -> None:
        """Set variables."""
        key = tuple(names)
        groups = self._writes.get(key)
        if groups is None:
            groups = self._writes[key] = self.instance.access(key)
        for access, positions in groups:
            try:
                self.instance.write(access, [values[k] for k in positions])
            except (TypeError, ValueError, AttributeError, OverflowError) as error:
                wrong = ", ".join(f"{names[k]} = {values[k]!r}" for k in positions[:3])
                raise ComponentError(f"FMU '{self.instance.name}': {wrong} is no {access.kind}: {error}") from error

    def get(self, names: Sequence[str]) -> list[Any]:
        """Values of variables."""
        key = tuple(names)
        groups = self._reads.get(key)
        if groups is None:
            groups = self._reads[key] = self.instance.access(key)
        if len(groups) == 1:
            return self.instance.read(groups[0][0])
        found: list[Any] = [None] * len(names)
        for access, positions in groups:
            for position, value in zip(positions, self.instance.read(access), strict=True):
                found[position] = value
        return found

    def prepare(self, values: dict[str, Any]) -> None:
        """Set what was collected before initialisation: structural parameters first, since they size the arrays."""
        structural = {n: v for n, v in values.items() if self._port(n).causality == "structuralParameter"}
        if structural:
            assert isinstance(self.instance, Instance3)
            self.instance.configure(list(structural), list(structural.values()))
            self._reads.clear()
            self._writes.clear()
        others = {name: value for name, value in values.items() if name not in structural}
        if others:
            self.set(list(others), list(others.values()))

    def repeat(self, values: dict[str, Any]) -> None:
        """Set parameters again that entering initialisation has set back, as FMUs of 20-sim do."""
        names = [name for name in values if self._port(name).causality == "parameter" and not self._port(name).shape]
        lost = [name for name, now in zip(names, self.get(names), strict=True) if now != values[name]]
        if lost:
            self.set(lost, [values[name] for name in lost])

    def _port(self, name: str) -> Port:
        if name not in self.instance.description.by_name:
            raise ComponentError(f"FMU '{self.instance.name}' has no variable {name!r}; see its description")
        return self.instance.description.by_name[name][0]


class SavedState:
    """A state that an FMU keeps for us, freed when nobody refers to it."""

    def __init__(self, instance: Instance) -> None:
        self._instance, self._time = instance, instance.time
        self._pointer = instance.save()

    def restore(self) -> None:
        """Set the FMU back to it."""
        self._instance.restore(self._pointer)
        self._instance.time = self._time

    def __del__(self) -> None:
        if hasattr(self, "_pointer"):
            self._instance.release(self._pointer)


class FmuComponent(Component):
    """An FMU as a component: what is set before initialisation is kept for it, all else goes to the instance."""

    kind = "fmu"

    def __init__(self, instance: Instance, interface: Interface) -> None:
        self.instance = instance
        self.ports, self.feedthrough = instance.description.ports, instance.description.feedthrough
        self.can_save, self.can_differentiate = interface.can_save, interface.can_differentiate
        self._values = Values(instance)
        self._prepared: dict[str, Any] | None = {}

    def initialise(self, time: float, stop: float | None, tolerance: float | None) -> None:
        """Set what was set before, and enter initialisation."""
        prepared, self._prepared = self._prepared, None
        if prepared:
            self._values.prepare(prepared)
        self.instance.begin(time, stop, tolerance)
        if prepared:
            self._values.repeat(prepared)

    def start(self) -> None:
        """Leave initialisation."""
        self.instance.finish_initialisation()

    def set(self, names: Sequence[str], values: Sequence[Any]) -> None:
        """Set variables; before initialisation they are kept for it."""
        if self._prepared is not None:
            self._prepared.update(zip(names, values, strict=True))
        else:
            self._values.set(names, values)

    def get(self, names: Sequence[str]) -> list[Any]:
        """Values of variables."""
        return self._values.get(names)

    def save(self) -> object:
        """The FMU's own copy of its state."""
        return SavedState(self.instance)

    def restore(self, state: object) -> None:
        """Go back to a saved state."""
        assert isinstance(state, SavedState)
        state.restore()

    def derivative(self, outputs: Sequence[str], inputs: Sequence[str], seed: Sequence[float]) -> list[float]:
        """Directional derivative by the FMU itself."""
        return self.instance.directional(outputs, inputs, seed)

    def terminate(self) -> None:
        """End the run and free the instance."""
        self.instance.terminate()
