"""A Python function of the inputs as a component without a state."""

import inspect
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from fmus.errors import MisfitError
from orchestrator.cosim.component import Component, Port, Timed
from orchestrator.cosim.kinds.code import Guarded, load_object, named_ports, told
from orchestrator.cosim.system import ComponentSpec
from orchestrator.measurements.wording import listed

_TIME = "time"


def open_function(spec: ComponentSpec, folder: Path) -> Component:
    """Make a component of the function that `source` names (`file.py:NAME` or `module:NAME`).

    Its arguments are the inputs; an argument `time` gets the time in s. Options: `inputs` and `outputs`, names or a table
    of names and units (by default the arguments without a value, and `y`); `constants`, values for other arguments.

    Raises:
        MisfitError: if there is no such function or its arguments are not what the options say.
    """
    function = load_object(spec.source, folder)
    if not callable(function):
        raise MisfitError(f"{spec.source} is no function")
    constants = spec.options.get("constants", {})
    arguments = inspect.signature(function).parameters
    free = [n for n, a in arguments.items() if a.default is a.empty and n not in constants and n != _TIME]
    inputs = named_ports(spec.options.get("inputs", free), "input", "inputs")
    outputs = named_ports(spec.options.get("outputs", ["y"]), "output", "outputs")
    for name in (*constants, *(port.name for port in inputs)):
        if name not in arguments:
            raise MisfitError(f"{spec.source} has no argument {name!r}; it has {listed(arguments)}")
    lacking = [name for name in free if name not in {port.name for port in inputs}]
    if lacking:
        raise MisfitError(f"{spec.source} needs {listed(lacking)}; add it to inputs or constants")
    return Guarded(spec.name, FunctionComponent(function, inputs, outputs, constants))


class FunctionComponent(Timed):
    """Outputs are a function of the inputs of the same instant, and of time where the function has that argument.

    The function returns a number, or one for each output.
    """

    kind = "function"

    def __init__(
        self,
        function: Callable[..., Any],
        inputs: Sequence[Port],
        outputs: Sequence[Port],
        constants: Mapping[str, Any],
    ) -> None:
        self.ports = (*inputs, *outputs)
        self.feedthrough = {output.name: tuple(port.name for port in inputs) for output in outputs}
        self._function, self._constants = function, dict(constants)
        self._outputs = tuple(port.name for port in outputs)
        self._values: dict[str, Any] = {port.name: port.start for port in inputs}
        self._with_time = _TIME in inspect.signature(function).parameters and _TIME not in self._values

    def set(self, names: Sequence[str], values: Sequence[Any]) -> None:
        """Keep inputs."""
        self._values.update(zip(names, values, strict=True))

    def get(self, names: Sequence[str]) -> list[Any]:
        """Values of inputs and outputs for the inputs set last."""
        if all(name in self._values for name in names):
            return [self._values[name] for name in names]
        extra = {_TIME: self._time} if self._with_time else {}
        found = self._function(**self._values, **self._constants, **extra)
        results = (found,) if np.ndim(found) == 0 else tuple(found)
        if len(results) != len(self._outputs):
            raise ValueError(f"{len(results)} values returned for the outputs {', '.join(self._outputs)}")
        values = {**self._values, **{name: float(x) for name, x in zip(self._outputs, results, strict=True)}}
        return [values[name] for name in names]

    def save(self) -> object:
        """Time and inputs."""
        return self._time, dict(self._values)

    def restore(self, state: object) -> None:
        """Go back to a state."""
        assert isinstance(state, tuple)
        self._time, self._values = state[0], dict(state[1])


def open_python(spec: ComponentSpec, folder: Path) -> Component:
    """Make an object of the class that `source` names; `arguments` of the options are passed to it.

    Raises:
        MisfitError: if there is no such class, it is no `Component`, or making an object fails.
    """
    made = load_object(spec.source, folder)
    arguments = spec.options.get("arguments", {})
    if not isinstance(made, type) or not issubclass(made, Component):
        raise MisfitError(f"{spec.source} is no class that extends orchestrator.cosim.Component")
    missing = sorted(getattr(made, "__abstractmethods__", ()))
    if missing:
        raise MisfitError(f"{spec.source} lacks {', '.join(missing)}, which every Component has")
    try:
        component = made(**arguments)
    except Exception as error:  # whatever the user's class raises
        raise MisfitError(f"{spec.source} cannot be made with arguments {arguments}: {told(error)}") from error
    for name in ("ports", "feedthrough"):
        if not hasattr(component, name):
            raise MisfitError(f"{spec.source} has no {name}; set it in the class or in __init__")
    return Guarded(spec.name, component)
