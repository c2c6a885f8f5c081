"""The master that repeats a step until the inputs at its end agree with what the components make of them."""

from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fmus.errors import ComponentError
from fmus.units import after_number
from orchestrator.cosim.masters.coupling import Coupling, is_float
from orchestrator.cosim.masters.master import Master
from orchestrator.cosim.masters.operations import Shape, connected_inputs
from orchestrator.cosim.masters.rollback import restore, save

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
