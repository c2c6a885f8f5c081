"""What a master is, and the masters that write their operations as a table."""

from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any, ClassVar

from fmus.errors import MisfitError
from orchestrator.cosim.graph import Loop, Read
from orchestrator.cosim.masters.coupling import Coupling, is_float
from orchestrator.cosim.masters.operations import Operation, Schedule, Settle, Shape, Shaper, Step, connected_inputs
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


class Ordered(TableMaster):
    """All components step, then outputs are read and inputs set in the order in which they depend on each other.

    At every communication point all values belong together. Inputs are held over a step, unless the options say otherwise:
    with `extrapolation` 1 they go on along a line, which makes the order two; `smoothing_s` is the time constant of a lag.
    """

    name = "ordered"
    option_names = ("extrapolation", "smoothing_s")

    def __init__(
        self,
        wiring: Wiring,
        order_of_reading: Sequence[Read | Loop],
        components: Sequence[str],
        settings: MasterSettings,
    ) -> None:
        super().__init__(wiring, order_of_reading, components, settings)
        extrapolation, smoothing = self.option("extrapolation", 0.0), self.option("smoothing_s", 0.0)
        if extrapolation not in (0.0, 1.0):
            raise MisfitError(f"option extrapolation = {extrapolation:g}: expected 0 (held) or 1 (along a line)")
        if extrapolation or smoothing:
            self.shaper = Shaper(extrapolation == 1.0, smoothing)

    @cached_property
    def operations(self) -> tuple[Operation, ...]:
        """Steps, then the evaluation at the next point."""
        return (*self._shapes(), *self.steps, *self.evaluation)

    def _shapes(self) -> tuple[Shape, ...]:
        if self.shaper is None:
            return ()
        found = {name: tuple(filter(is_float, slots)) for name, slots in connected_inputs(self.wiring).items()}
        return tuple(Shape(name, slots) for name, slots in found.items() if slots)


class Jacobi(TableMaster):
    """All outputs are read, then all inputs set, then all components step: one step late wherever inputs act at once.

    Only algebraic loops are solved, since going around them once a step need not lead anywhere.
    """

    name = "jacobi"

    @cached_property
    def operations(self) -> tuple[Operation, ...]:
        """Steps, reads, writes."""
        schedule = Schedule(self.wiring)
        reads = [schedule.get(read.component, read.outputs) for read in self.reads]
        return (*self.steps, *reads, *schedule.rest(), *schedule.evaluation(self.loops), *self.events)


class GaussSeidel(TableMaster):
    """One component after the other steps with what those before it have already reached.

    Components step in the order in which their outputs are needed; one with a longer step of its own takes it when the
    others have arrived at its end, one with a shorter step takes several. Algebraic loops are solved when all have stepped.
    """

    name = "gauss_seidel"

    def __init__(
        self,
        wiring: Wiring,
        order_of_reading: Sequence[Read | Loop],
        components: Sequence[str],
        settings: MasterSettings,
    ) -> None:
        reads = (part.reads if isinstance(part, Loop) else (part,) for part in order_of_reading)
        first_read = {read.component: None for group in reads for read in group}
        ordered = [*first_read, *(name for name in components if name not in first_read)]
        super().__init__(wiring, order_of_reading, ordered, settings)

    @cached_property
    def operations(self) -> tuple[Operation, ...]:
        """For every component: write, step, read."""
        schedule = Schedule(self.wiring)
        reads: dict[str, list[str]] = {}
        for read in self.reads:
            reads.setdefault(read.component, []).extend(read.outputs)
        # What the last component has written waits for the first one of the next step.
        for component, outputs in reads.items():
            schedule.get(component, outputs)
        found: list[Operation] = []
        for step in self.steps:
            found += schedule.set(step.component)
            found.append(step)
            if step.component in reads:
                found.append(schedule.get(step.component, reads[step.component]))
        return (*found, *schedule.evaluation(self.loops), *self.events) if self.loops else (*found, *self.events)
