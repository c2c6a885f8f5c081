"""The masters without repetition: dependency-ordered, Jacobi, Gauss-Seidel."""

from collections.abc import Sequence
from functools import cached_property

from fmus.errors import MisfitError
from orchestrator.cosim.graph import Loop, Read
from orchestrator.cosim.masters.coupling import is_float
from orchestrator.cosim.masters.master import MasterSettings, TableMaster
from orchestrator.cosim.masters.operations import Operation, Schedule, Shape, connected_inputs
from orchestrator.cosim.masters.shaping import Shaper
from orchestrator.cosim.wiring import Wiring


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
