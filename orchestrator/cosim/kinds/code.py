"""Python that a user wrote: found by `file.py:Name` or `module:Name`, and its mistakes told as those of a component."""

import hashlib
import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from importlib import import_module
from importlib.util import module_from_spec, spec_from_file_location
from pathlib import Path
from types import ModuleType
from typing import Any

from fmus.errors import ComponentError, MisfitError
from orchestrator.cosim.component import Component, Port, StepEnd
from orchestrator.measurements.wording import nearest, shown


def named_ports(given: Any, causality: str, key: str) -> tuple[Port, ...]:
    """Make ports of `["u1", "u2"]` or `{ u1 = "m", u2 = "" }`; inputs start at 0.

    Raises:
        MisfitError: if `given` is neither.
    """
    names = isinstance(given, list | tuple) and all(isinstance(name, str) for name in given)
    units = dict.fromkeys(given, "") if names else given
    if not isinstance(units, dict) or not all(isinstance(text, str) for pair in units.items() for text in pair):
        raise MisfitError(
            f'{key} = {shown(given)}; expected names, such as ["u"], or names with units, such as {{ u = "m" }}'
        )
    start = 0.0 if causality == "input" else None
    return tuple(Port(name, causality, unit=unit, start=start) for name, unit in units.items())


def load_object(source: str, folder: Path) -> Any:
    """What a source names: `controller.py:Controller` with the file below `folder`, or `package.module:Controller`.

    Raises:
        MisfitError: if there is no such file, module or name, or importing it fails.
    """
    place, colon, name = source.rpartition(":")
    if not colon or not place or not name:
        raise MisfitError(f"{source!r} names no Python object; expected file.py:NAME or package.module:NAME")
    try:
        module = _module_of_file(folder / place) if place.endswith(".py") else import_module(place)
    except MisfitError:
        raise
    except Exception as error:  # whatever the user's module raises
        raise MisfitError(f"{place} cannot be imported: {told(error)}") from error
    if not hasattr(module, name):
        raise MisfitError(
            f"{place} has no {name!r}; {nearest(name, (n for n in vars(module) if not n.startswith('_')))}"
        )
    return getattr(module, name)


def told(error: Exception) -> str:
    """An exception on one line, with the line of code that raised it."""
    words = " ".join(str(error).split())
    trace = error.__traceback__
    while trace is not None and trace.tb_next is not None:
        trace = trace.tb_next
    place = "" if trace is None else f" ({Path(trace.tb_frame.f_code.co_filename).name}, line {trace.tb_lineno})"
    return f"{type(error).__name__}: {words}{place}" if words else f"{type(error).__name__}{place}"


def _module_of_file(path: Path) -> ModuleType:
    path = path.resolve()
    if not path.is_file():
        raise MisfitError(f"{path} does not exist; expected a Python file")
    name = f"misfit_user_{hashlib.sha256(str(path).encode()).hexdigest()[:12]}_{path.stem}"
    spec = spec_from_file_location(name, path)
    assert spec is not None and spec.loader is not None
    module = module_from_spec(spec)
    sys.modules[name] = module
    try:
        spec.loader.exec_module(module)
    except BaseException:
        del sys.modules[name]
        raise
    return module


class Guarded(Component):
    """A user's component whose exceptions become ComponentError with its name and the time."""

    kind = "python"

    def __init__(self, name: str, inside: Component) -> None:
        self._name, self._inside, self._time = name, inside, 0.0
        with self._guard("describing its ports"):
            self.ports, self.feedthrough = tuple(inside.ports), dict(inside.feedthrough)
        self.follows_inputs, self.variable_step = inside.follows_inputs, inside.variable_step
        self.own_step = inside.own_step
        self.can_save, self.can_differentiate = inside.can_save, inside.can_differentiate

    @contextmanager
    def _guard(self, doing: str) -> Iterator[None]:
        try:
            yield
        except ComponentError:
            raise
        except Exception as error:
            raise ComponentError(
                f"component {self._name!r} failed {doing} at t = {self._time:.9g} s: {told(error)}"
            ) from error

    def initialise(self, time: float, stop: float | None, tolerance: float | None) -> None:
        """Enter initialisation."""
        self._time = time
        with self._guard("to initialise"):
            self._inside.initialise(time, stop, tolerance)

    def start(self) -> None:
        """Leave initialisation."""
        with self._guard("to start"):
            self._inside.start()

    def set(self, names: Sequence[str], values: Sequence[Any]) -> None:
        """Set ports."""
        with self._guard(f"to take {', '.join(names)}"):
            self._inside.set(names, values)

    def get(self, names: Sequence[str]) -> list[Any]:
        """Values of ports."""
        with self._guard(f"to give {', '.join(names)}"):
            values = list(self._inside.get(names))
        if len(values) != len(names):
            raise ComponentError(f"component {self._name!r} gave {len(values)} values for {', '.join(names)}")
        return values

    def step(self, time: float, size: float) -> StepEnd:
        """Advance."""
        self._time = time
        with self._guard(f"to step by {size:g} s"):
            end = self._inside.step(time, size)
        if not isinstance(end, StepEnd):
            raise ComponentError(f"component {self._name!r}: step returned {type(end).__name__}, expected a StepEnd")
        self._time = end.time
        return end

    def terminate(self) -> None:
        """End the run."""
        with self._guard("to terminate"):
            self._inside.terminate()

    def save(self) -> object:
        """The state."""
        with self._guard("to save its state"):
            return self._inside.save()

    def restore(self, state: object) -> None:
        """Go back to a state."""
        with self._guard("to restore a state"):
            self._inside.restore(state)

    def derivative(self, outputs: Sequence[str], inputs: Sequence[str], seed: Sequence[float]) -> list[float]:
        """Directional derivative."""
        with self._guard("to differentiate"):
            return self._inside.derivative(outputs, inputs, seed)
