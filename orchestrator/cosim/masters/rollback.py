"""Masters that go back in time: steps repeated until the values agree, and steps as long as an error allows."""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fmus.errors import ComponentError
from fmus.units import after_number
from orchestrator.cosim.masters.coupling import Coupling, StepCut, is_float
from orchestrator.cosim.masters.master import Master
from orchestrator.cosim.masters.operations import Shape, connected_inputs


@dataclass(frozen=True)
class Point:
    """Everything at one communication point."""

    states: Mapping[str, object]
    values: tuple[Any, ...]
    time: float


def save(coupling: Coupling) -> Point:
    """Save all components.

    Raises:
        ComponentError: if one of them cannot.
    """
    states = {}
    for name, component in coupling.components.items():
        coupling.progress.enter(coupling.number[name], "save", coupling.time)
        states[name] = component.save()
    return Point(states, tuple(coupling.values), coupling.time)


def restore(coupling: Coupling, point: Point) -> None:
    """Go back; a point can be gone back to more than once."""
    for name, component in coupling.components.items():
        coupling.progress.enter(coupling.number[name], "restore", point.time)
        component.restore(point.states[name])
    coupling.values[:] = point.values
    coupling.time = coupling.last_good = point.time
    coupling.ended = None


_MEMORY = 5


class Iterative(Master):
    """The trapezoidal rule for inputs: over a step they are the mean of both ends, the end found by iteration.

    Every turn goes back to the beginning of the step, lets all components step with the mean, and evaluates everything at
    the end without a delay. The end's inputs are found by the quasi-Newton method of Degroote et al. (2009) with the last
    turns' differences (IQN-ILS, the same as Anderson's), which solves a linear interface of n values in n + 2 turns.
    """

    name = "iterative"
    order = 2
    needs_rollback = True
    option_names = ("turns",)

    def advance(self, coupling: Coupling, k: int, start: float, size: float) -> bool:
        """One step, repeated; whether the run goes on."""
        time, beginning = start + k * size, save(coupling)
        slots = [slot for each in connected_inputs(self.wiring).values() for slot in each if is_float(slot)]
        places = [p for slot in slots for p in range(slot.first, slot.first + slot.port.size)]
        nominal = np.array([abs(s.port.nominal or 1.0) for s in slots for _ in range(s.port.size)])
        first = self._read(coupling, places)
        guess, memory = first, _Memory()
        turns = int(self.option("turns", 40.0))
        for turn in range(turns):
            if turn > 0:
                restore(coupling, beginning)
            if not self._turn(coupling, places, 0.5 * (first + guess), k, start, size):
                return False
            found = self._read(coupling, places)
            rest = found - guess
            worst = float(np.max(np.abs(rest) / np.maximum(np.abs(found), nominal), initial=0.0))
            if worst <= self.settings.tolerance:
                return True
            guess = memory.next(guess, found)
        place = int(np.argmax(np.abs(rest) / np.maximum(np.abs(found), nominal)))
        slot = next(s for s in slots if s.first <= places[place] < s.first + s.port.size)
        raise ComponentError(
            f"the step from t = {time:.9g} s (step {size:.9g} s) did not settle in {turns} turns: {slot.address} still "
            f"moves by {rest[place]:.3g}{after_number(slot.port.unit)}; take a smaller step"
        )

    def _turn(
        self, coupling: Coupling, places: list[int], mean: NDArray[np.float64], k: int, start: float, size: float
    ) -> bool:
        if places:
            for place, value in zip(places, mean.tolist(), strict=True):
                coupling.values[place] = value
            for operation in self._writes:
                coupling.write(operation, start + k * size)
        return coupling.carry_out((*self.steps, *self.evaluation), k, start, size)

    @cached_property
    def _writes(self) -> tuple[Shape, ...]:
        found = {name: tuple(filter(is_float, slots)) for name, slots in connected_inputs(self.wiring).items()}
        return tuple(Shape(name, slots) for name, slots in found.items() if slots)

    def _read(self, coupling: Coupling, places: list[int]) -> NDArray[np.float64]:
        return np.array([coupling.values[place] for place in places], dtype=float)


class _Memory:
    """Guesses and what came of them, for the next guess."""

    def __init__(self) -> None:
        self._guesses: list[Any] = []
        self._found: list[Any] = []

    def next(self, guess: NDArray[np.float64], found: NDArray[np.float64]) -> NDArray[np.float64]:
        """The next guess, from the differences between the last ones in the least squares sense."""
        self._guesses, self._found = [*self._guesses, guess][-_MEMORY - 1 :], [*self._found, found][-_MEMORY - 1 :]
        rest = found - guess
        if len(self._found) < 2:
            return found
        rests = [f - g for f, g in zip(self._found, self._guesses, strict=True)]
        moves = np.column_stack([rest - r for r in rests[:-1]])
        answers = np.column_stack([found - f for f in self._found[:-1]])
        weights, *_ = np.linalg.lstsq(moves, rest, rcond=1e-10)
        return found - answers @ weights


_SAFETY, _SHRINK, _GROW = 0.9, 0.2, 4.0


class Adaptive(Master):
    """Dependency-ordered steps whose size follows the error: the difference between one step and two of half the size.

    The error of a step of this master is of order two, so twice the difference bounds that of the halves
    (Hairer, Norsett, Wanner, Solving ODE I, II.4). The finer result is kept. Where a component ends its step early, at an
    event, the step is repeated up to there, so that all components meet at the event.
    """

    name = "adaptive"
    needs_rollback = True
    adaptive = True
    option_names = ("smallest_step", "largest_step")

    _wish = 0.0

    def advance(self, coupling: Coupling, k: int, start: float, size: float) -> bool:
        """One accepted step of at most `size` s from the present time, which `coupling.time` tells; whether the run goes on."""
        time, most, beginning = coupling.time, size, save(coupling)
        smallest = self.option("smallest_step", 1e-9 * max(self.settings.step, 1.0))
        wish = min(self._wish or self.settings.step, self.option("largest_step", np.inf))
        while True:
            step = min(wish, most)
            coupling.cut_at_events = step > smallest
            try:
                going, error = self._compare(coupling, beginning, step)
            except StepCut as cut:
                restore(coupling, beginning)
                wish = max(cut.time - time, smallest)
                continue
            if not going:
                return False
            factor = _GROW if error == 0.0 else min(_GROW, max(_SHRINK, _SAFETY * error**-0.5))
            if error <= 1.0:
                # A step cut short by the end of the run says nothing about the next one.
                self._wish = step * factor if step == wish else max(wish, step * factor)
                return True
            restore(coupling, beginning)
            wish = step * factor
            if wish < smallest:
                raise ComponentError(
                    f"the error stays above the tolerance {self.settings.tolerance:g} at t = {time:.9g} s although the step "
                    f"has shrunk to {wish:.3g} s; loosen the tolerance, or look for a jump there"
                )

    def _compare(self, coupling: Coupling, beginning: Point, step: float) -> tuple[bool, float]:
        """One step, then two of half the size, which stay: whether the run goes on, and the error in tolerances."""
        time = beginning.time
        if not self._step_once(coupling, time, step):
            return False, 0.0
        coarse = self._outputs(coupling)
        restore(coupling, beginning)
        middle = time + 0.5 * step
        if not (self._step_once(coupling, time, 0.5 * step) and self._step_once(coupling, middle, 0.5 * step)):
            return False, 0.0
        coupling.time = coupling.last_good = coupling.not_past_stop(time + step, step)
        return True, self._error(coarse, self._outputs(coupling))

    def _step_once(self, coupling: Coupling, time: float, size: float) -> bool:
        return coupling.carry_out((*self.steps, *self.evaluation), 0, time, size)

    def _outputs(self, coupling: Coupling) -> NDArray[np.float64]:
        return np.array([coupling.values[place] for place, _ in self._compared], dtype=float)

    @cached_property
    def _compared(self) -> list[tuple[int, float]]:
        outputs = (slot for slot in self.wiring.slots if slot.port.causality == "output" and slot.component)
        return [
            (slot.first + k, abs(slot.port.nominal or 1.0))
            for slot in outputs
            if is_float(slot)
            for k in range(slot.port.size)
        ]

    def _error(self, coarse: NDArray[np.float64], fine: NDArray[np.float64]) -> float:
        """Largest difference, in tolerances; an error within 1 is accepted."""
        nominal = np.array([nominal for _, nominal in self._compared])
        scale = self.settings.tolerance * np.maximum(nominal, np.abs(fine))
        return float(np.max(np.abs(fine - coarse) / scale, initial=0.0))
