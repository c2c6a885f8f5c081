"""A component in a process of its own, behind the contract of all components."""

import weakref
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from orchestrator.cosim.component import Component, StepEnd
from orchestrator.cosim.isolate.process import Child, ChildLimits, label
from orchestrator.cosim.system import ComponentSpec


class _State:
    """A state that the child keeps under a number."""

    def __init__(self, number: int) -> None:
        self.number = number


class IsolatedComponent(Component):
    """Passes every call on; a crash, a hang or too much memory there is a ComponentError here."""

    def __init__(self, spec: ComponentSpec, folder: Path, limits: ChildLimits | None = None) -> None:
        self._child = Child("component", [label(spec)], limits or ChildLimits())
        self._child.send(spec, folder)
        self._dropped: list[int] = []
        for name, value in self._answer().items():
            setattr(self, name, value)

    def initialise(self, time: float, stop: float | None, tolerance: float | None) -> None:
        """Enter initialisation."""
        self._call("initialise", time, stop, tolerance)

    def start(self) -> None:
        """Leave initialisation."""
        self._call("start")

    def set(self, names: Sequence[str], values: Sequence[Any]) -> None:
        """Set ports."""
        self._call("set", names, values)

    def get(self, names: Sequence[str]) -> list[Any]:
        """Values of ports."""
        return self._call("get", names)

    def step(self, time: float, size: float) -> StepEnd:
        """Advance."""
        return self._call("step", time, size)

    def terminate(self) -> None:
        """End the run and the process."""
        if not self._child.close.alive:
            return
        try:
            self._call("terminate")
        finally:
            self._child.close()

    def save(self) -> object:
        """The state; it lives in the child as long as the object that is returned."""
        number = self._call("save")
        state = _State(number)
        weakref.finalize(state, self._dropped.append, number)
        return state

    def restore(self, state: object) -> None:
        """Go back to a state given by `save`."""
        assert isinstance(state, _State)
        self._call("restore", state.number)

    def derivative(self, outputs: Sequence[str], inputs: Sequence[str], seed: Sequence[float]) -> list[float]:
        """Directional derivative."""
        return self._call("derivative", outputs, inputs, seed)

    def _call(self, name: str, *arguments: Any) -> Any:
        dropped = self._dropped[:]
        del self._dropped[: len(dropped)]
        self._child.send(name, arguments, dropped)
        return self._answer()

    def _answer(self) -> Any:
        return self._child.receive()[1]
