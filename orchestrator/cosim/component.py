"""What a master steps: the contract that FMUs, players, controllers and a user's own class fulfil."""

from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, ClassVar

import numpy as np

from fmus.errors import ComponentError, MisfitError
from fmus.units import SiUnit

FLOATS = ("Float64", "Float32")
INTEGERS = ("Int8", "UInt8", "Int16", "UInt16", "Int32", "UInt32", "Int64", "UInt64")


@dataclass(frozen=True)
class Port:
    """A variable of a component that can be connected, set or recorded, in the words of FMI 3.

    `type` is one of `TYPES` (Real of FMI 2 is Float64, Integer is Int32). `shape` is () for a scalar, else the sizes of
    an array at the start values of structural parameters. `unit` is a name such as `N.m`, "" where nobody said; `si` is
    what the component itself defines the name to mean. `initial` is exact, approx, calculated or "". `items` are the
    (name, value) pairs of an enumeration. The `variability` of a clock is that of its interval, such as triggered or countdown;
    `clocks` are those whose ticks a variable belongs to, without which it neither changes nor has a meaning.
    """

    name: str
    causality: str
    type: str = "Float64"
    shape: tuple[int, ...] = ()
    unit: str = ""
    variability: str = "continuous"
    start: Any = None
    minimum: float | None = None
    maximum: float | None = None
    nominal: float | None = None
    description: str = ""
    initial: str = ""
    si: SiUnit | None = None
    items: tuple[tuple[str, int], ...] = ()
    clocks: tuple[str, ...] = ()

    @property
    def size(self) -> int:
        """Number of elements; 1 for a scalar."""
        return int(np.prod(self.shape, dtype=int))

    @property
    def elements(self) -> list[str]:
        """Column names of the elements: `x`, or `x[1]`, `x[2]` (row-major, counted through).

        Example:
            >>> Port("q", "output", shape=(2,)).elements
            ['q[1]', 'q[2]']
        """
        return [f"{self.name}[{k + 1}]" for k in range(self.size)] if self.shape else [self.name]


@dataclass(frozen=True)
class StepEnd:
    """How a step ended: the time reached in s, whether that is early (an event), whether the component wants to stop."""

    time: float
    early: bool = False
    terminated: bool = False


class Component(ABC):
    """Something with ports that advances in time.

    Life: `initialise`, any number of `set` and `get`, `start`, then `set`, `get` and `step` in turn, `terminate` at
    the end, also after an error. A scalar value is a float, int, bool, str or bytes, an array a NumPy array of the
    port's shape, each in the unit of the port. Every method raises ComponentError when the component fails.

    `feedthrough` maps an output to the inputs it depends on without a step in between; an output that is missing
    there depends on all of them. `follows_inputs` is False where an output keeps its value until the next step
    although an input has changed, such as a bus; then no order of evaluation can avoid a delay of one step.
    `variable_step` is False for steps of one size only, `own_step` s.
    """

    ports: Sequence[Port]
    feedthrough: Mapping[str, Sequence[str]]
    follows_inputs: bool = True
    variable_step: bool = True
    own_step: float | None = None
    can_save: bool = False
    can_differentiate: bool = False
    kind: ClassVar[str] = "component"

    @abstractmethod
    def initialise(self, time: float, stop: float | None, tolerance: float | None) -> None:
        """Enter initialisation; parameters and inputs can be set from now on, outputs read.

        Args:
            time: at which the run begins (s).
            stop: time at which it ends (s); None if that is not known.
            tolerance: relative error that a component with a solver of its own may make; None for its own choice.
        """

    @abstractmethod
    def start(self) -> None:
        """Leave initialisation; from now on the component can step."""

    @abstractmethod
    def set(self, names: Sequence[str], values: Sequence[Any]) -> None:
        """Set ports.

        Args:
            names: of inputs or parameters among `ports`.
            values: one for each name, in the port's own unit; an array port takes an array of its shape.
        """

    @abstractmethod
    def get(self, names: Sequence[str]) -> list[Any]:
        """Values of ports at the time reached, for the inputs set last."""

    @abstractmethod
    def step(self, time: float, size: float) -> StepEnd:
        """Advance by one step.

        Args:
            time: at which the step begins (s).
            size: of the step (s).

        Returns:
            The time reached, which is earlier than `time + size` only if the component ended its step early.

        Raises:
            ComponentError: if the component cannot go on.
        """

    @abstractmethod
    def terminate(self) -> None:
        """End the run and free everything; calling it again does nothing."""

    def save(self) -> object:
        """The state, to come back to with `restore`, if `can_save`."""
        raise ComponentError(f"a {self.kind} component cannot save its state; use a master without rollback")

    def restore(self, state: object) -> None:
        """Go back to a state given by `save`; a state can be restored more than once."""
        raise ComponentError(f"a {self.kind} component cannot restore a state; use a master without rollback")

    def write_fmu(self, path: Path) -> None:
        """Write what the component does as an FMU for co-simulation with the same ports, for an FMU of the whole system.

        Raises:
            MisfitError: if it cannot; the message does not name the component.
        """
        raise MisfitError(f"a {self.kind} component cannot be put into an FMU")

    def derivative(self, outputs: Sequence[str], inputs: Sequence[str], seed: Sequence[float]) -> list[float]:
        """Directional derivative of scalar outputs along a direction of scalar inputs, if `can_differentiate`.

        Args:
            outputs: (n,) names.
            inputs: (m,) names.
            seed: (m,) direction.

        Returns:
            (n,) d outputs / d inputs times the seed, in the units of the ports.
        """
        raise ComponentError(f"a {self.kind} component offers no derivatives; use differences")


class Timed(Component):
    """A component for which only time passes: what else there is to do in a step, and to save, is up to its class."""

    can_save = True
    _time = 0.0

    def initialise(self, time: float, stop: float | None, tolerance: float | None) -> None:
        """Begin at a time."""
        self._time = time

    def start(self) -> None:
        """Nothing to do."""

    def step(self, time: float, size: float) -> StepEnd:
        """Only time passes."""
        self._time = time + size
        return StepEnd(self._time)

    def terminate(self) -> None:
        """Nothing to do."""

    def save(self) -> object:
        """The time."""
        return self._time

    def restore(self, state: object) -> None:
        """Go back to a time."""
        assert isinstance(state, float)
        self._time = state


class Clocked(Component):
    """A component with an event mode.

    In event mode clocks tick, inputs are set and outputs read until an `update` changes nothing any more; then it goes back
    to stepping. Discrete inputs that are set between two steps begin an event by themselves.
    """

    output_clocks: Sequence[str] = ()

    @property
    @abstractmethod
    def wants_event(self) -> bool:
        """Whether something has happened that event mode has to deal with."""

    @abstractmethod
    def next_event(self) -> float:
        """When the next event is due, in s; infinity if none is planned."""

    @abstractmethod
    def enter_event(self) -> None:
        """Go into event mode, if it is not there yet."""

    @abstractmethod
    def due(self, time: float) -> list[str]:
        """The input clocks whose time has come at `time` s; each is told once."""

    @abstractmethod
    def tick(self, clocks: Sequence[str]) -> None:
        """Let input clocks tick."""

    @abstractmethod
    def ticking(self) -> list[str]:
        """The output clocks that tick now; each tick is told once."""

    @abstractmethod
    def update(self) -> bool:
        """End a turn of the event; whether another one has to follow."""

    @abstractmethod
    def leave_event(self, time: float) -> None:
        """Go back to stepping at `time` s, if it is in event mode."""
