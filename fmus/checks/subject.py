"""What is checked: an unpacked FMU, its description, and its variables of type Real or Float64 with their sizes."""

from dataclasses import dataclass
from functools import cached_property
from math import inf, prod
from pathlib import Path
from typing import Any

FLOATS = ("Real", "Float64")
# Steps of a run, and the number of instances that run at a time.
STEPS, THREADS = 20, 4
LONGEST_STRIDE = 20  # communication steps


@dataclass(frozen=True)
class Numbers:
    """A scalar or an array of floating-point numbers."""

    variable: Any  # of the model description
    size: int

    @property
    def names(self) -> list[str]:
        """One name for each element: `x`, or `q[1]`, `q[2]` (row-major, counted through)."""
        name = str(self.variable.name)
        return [f"{name}[{k + 1}]" for k in range(self.size)] if self.variable.dimensions else [name]

    def moved(self, value: float, share: float = 0.01) -> float:
        """A value close by that the declared range allows."""
        low, high = (float(limit) if limit is not None else None for limit in (self.variable.min, self.variable.max))
        step = share * max(abs(value), 1.0)
        if high is not None and value + step > high:
            step = -step
        return min(max(value + step, -inf if low is None else low), inf if high is None else high)


@dataclass(frozen=True)
class Subject:
    """An unpacked FMU and its description, as FMPy reads it."""

    folder: Path
    description: Any

    @cached_property
    def numbers(self) -> list[Numbers]:
        """All variables that are floating-point numbers, each value reference once."""
        found: dict[int, Numbers] = {}
        for variable in self.description.modelVariables:
            if variable.type in FLOATS:
                found.setdefault(variable.valueReference, Numbers(variable, element_count(variable)))
        return list(found.values())

    def numbers_of(self, *causalities: str, variability: str = "continuous") -> list[Numbers]:
        """The numbers of some causalities and one variability."""
        return [
            n for n in self.numbers if n.variable.causality in causalities and n.variable.variability == variability
        ]

    @property
    def recorded(self) -> list[Numbers]:
        """All numbers that the model computes while it runs."""
        return self.numbers_of("output", "local")

    @property
    def has_clocks(self) -> bool:
        """Whether there are clocks and the mode in which they tick: such an FMU may refuse to run without it."""
        clocks = any(variable.type == "Clock" for variable in self.description.modelVariables)
        return clocks and bool(getattr(self.description.coSimulation, "hasEventMode", False))

    @property
    def start(self) -> float:
        """Start time, s."""
        return float(getattr(self.description.defaultExperiment, "startTime", None) or 0.0)

    @property
    def stop(self) -> float:
        """Stop time of the default experiment, s; one second after the start if there is none."""
        return float(getattr(self.description.defaultExperiment, "stopTime", None) or self.start + 1.0)

    @property
    def step(self) -> float:
        """Communication step, s."""
        interface, experiment = self.description.coSimulation, self.description.defaultExperiment
        fixed = getattr(interface, "fixedInternalStepSize", None)
        step = getattr(experiment, "stepSize", None) or fixed
        return float(step) if step else (self.stop - self.start) / 1000

    @property
    def stride(self) -> float:
        """Step of the runs that are compared bit by bit, s: they cover the experiment, but not at any cost."""
        steps = (self.stop - self.start) / self.step / (2 * STEPS + THREADS)
        return self.step * min(max(1, int(steps)), LONGEST_STRIDE)

    def interface(self, kind: str) -> Any:
        """The description of `CoSimulation` or `ModelExchange`, None where not offered."""
        return self.description.coSimulation if kind == "CoSimulation" else self.description.modelExchange


def element_count(variable: Any) -> int:
    """Number of elements, with structural parameters at their start values; 1 for a scalar."""
    return prod(int(d.start if d.start is not None else d.variable.start) for d in variable.dimensions)
