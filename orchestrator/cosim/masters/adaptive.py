"""The master that chooses its steps: one step is compared with two of half the size."""

from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from fmus.errors import ComponentError
from orchestrator.cosim.masters.coupling import Coupling, StepCut, is_float
from orchestrator.cosim.masters.master import Master
from orchestrator.cosim.masters.rollback import Point, restore, save

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
