"""What a master is: how a system gets from one communication point to the next."""

from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, ClassVar

from fmus.errors import MisfitError
from orchestrator.cosim.graph import Loop, Read
from orchestrator.cosim.masters.coupling import Coupling
from orchestrator.cosim.masters.operations import Operation, Schedule, Settle, Step
from orchestrator.cosim.masters.shaping import Shaper
from orchestrator.cosim.wiring import Wiring


@dataclass(frozen=True)
class MasterSettings:
    """What masters are told: the communication step in s, tolerance, own steps of components in s, options by name."""

    step: float
    tolerance: float = 1e-6
    own_steps: Mapping[str, float] = field(default_factory=dict)
    options: Mapping[str, Any] = field(default_factory=dict)


class Master(ABC):
    """Advances a system; `order` is how the error of smooth systems shrinks with the step.

    Args:
        wiring: of the system.
        order_of_reading: the plan of `graph.plan`, for everything at one instant.
        components: names of all components, in the order in which they step.
        settings: see there.
    """

    order: ClassVar[int] = 1
    name: ClassVar[str]
    option_names: ClassVar[tuple[str, ...]] = ()
    needs_rollback: ClassVar[bool] = False
    adaptive: ClassVar[bool] = False
    shaper: Shaper | None = None

    def __init__(
        self,
        wiring: Wiring,
        order_of_reading: Sequence[Read | Loop],
        components: Sequence[str],
        settings: MasterSettings,
    ) -> None:
        self.wiring, self.components, self.settings = wiring, tuple(components), settings
        self.check_options()
        self.reads = tuple(part for part in order_of_reading if isinstance(part, Read))
        self.loops = tuple(part for part in order_of_reading if isinstance(part, Loop))
        evaluation = Schedule(wiring).evaluation(order_of_reading)
        self.events = (Settle(evaluation),) if wiring.ticking else ()
        self.evaluation: tuple[Operation, ...] = (*evaluation, *self.events)
        self.steps = tuple(self._step(name) for name in self.components)

    def check_options(self) -> None:
        """Refuse options that this master does not know."""
        for name in self.settings.options:
            if name not in self.option_names:
                known = ", ".join(self.option_names) or "none"
                raise MisfitError(f"master {self.name!r} has no option {name!r}; it has {known}")

    def option(self, name: str, default: float) -> float:
        """A number among the options."""
        value = self.settings.options.get(name, default)
        if isinstance(value, bool) or not isinstance(value, int | float) or not value >= 0.0:
            raise MisfitError(f"option {name} = {value!r} of master {self.name!r}: expected a number, zero or more")
        return float(value)

    def prepare(self, coupling: Coupling) -> None:
        """Evaluate everything at the first communication point."""
        coupling.evaluate(self.evaluation, coupling.time)

    @abstractmethod
    def advance(self, coupling: Coupling, k: int, start: float, size: float) -> bool:
        """Go from `start + k size` s to the next point; whether the run goes on."""

    def _step(self, name: str) -> Step:
        own, step = self.settings.own_steps.get(name), self.settings.step
        if own is None:
            return Step(name)
        every, pieces = round(own / step), round(step / own)
        if every >= 1 and abs(every * step - own) <= 1e-9 * own:
            return Step(name, every=every)
        if pieces >= 1 and abs(pieces * own - step) <= 1e-9 * step:
            return Step(name, pieces=pieces)
        raise MisfitError(
            f"{name}: its step {own:g} s is neither a multiple nor a fraction of the communication step {step:g} s; choose one that is"
        )


class TableMaster(Master):
    """A master that does the same operations in every step, so that the engine can do them as well."""

    @property
    @abstractmethod
    def operations(self) -> tuple[Operation, ...]:
        """From one communication point to the next."""

    def advance(self, coupling: Coupling, k: int, start: float, size: float) -> bool:
        """Carry out the table; where clocks tick within the step, all components meet at each tick."""
        if not self.events:
            return coupling.carry_out(self.operations, k, start, size)
        time, end = coupling.not_past_stop(start + k * size, size), coupling.not_past_stop(start + (k + 1) * size, size)
        coupling.carry_out_one(self.events[0], -1, time, 0.0)  # what was set since the last step
        if any(
            (step.every, step.pieces) != (1, 1) or not coupling.components[step.component].variable_step
            for step in self.steps
        ):
            return coupling.carry_out(self.operations, k, start, size)
        while end - time > 1e-12 * max(1.0, abs(end)):
            due = coupling.events.next(coupling)
            part = due - time if time < due < end else end - time
            if not coupling.carry_out(self.operations, 0, time, part):
                return False
            time = coupling.time
        coupling.time = coupling.last_good = end
        return True
