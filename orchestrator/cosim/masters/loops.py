"""Algebraic loops: Newton's method on the inputs where a loop is cut open."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from fmus.errors import ComponentError
from orchestrator.cosim.masters.operations import Carrying, Get, Set, Solve

_MOST_TURNS = 30
# A value may differ by that much from what comes back around the loop, relative to its size.
_TOLERANCE = 1e-10
# Below that share of the sizes involved, 1 - gain is rounding.
_SINGULAR = 1e-9
_NUDGE = 1e-6


def solve_loop(coupling: Carrying, operation: Solve, time: float) -> None:
    """Find the values with which a loop agrees; the components have them afterwards.

    With x the values of the torn inputs and g(x) what comes back around the loop, x is moved by (1 - g')^-1 (g(x) - x).
    For a linear loop the first move arrives but for rounding.

    Args:
        coupling: the components and their values.
        operation: the loop.
        time: in s, for messages.

    Raises:
        ComponentError: if there is no solution (1 - g' is singular) or none is found; the loop and its gain are named.
    """
    loop = _Loop(coupling, operation, time)
    if not loop.is_real:
        _repeat(loop)
        return
    x, slopes, before = loop.guess(), None, np.inf
    for _ in range(_MOST_TURNS):
        rest = loop.around(x) - x
        size = float(np.max(np.abs(rest) / np.maximum(np.abs(x), loop.nominal)))
        # Rounding is reached when it gets no better.
        if size == 0.0 or (size <= _TOLERANCE and size >= 0.5 * before):
            return
        if slopes is None or size > 0.1 * before:
            slopes = loop.slopes(x, rest + x)
            _refuse_singular(loop, slopes)
        x = x + np.linalg.solve(np.eye(len(x)) - slopes, rest)
        before = size
    gain = f"; its gain is {loop_gain(slopes):.6g}" if slopes is not None else ""
    raise ComponentError(
        f"the algebraic loop {operation.loop} has no solution that Newton's method finds at t = {time:.9g} s{gain}; "
        f"last good state is t = {coupling.last_good:.9g} s"
    )


def loop_gain(slopes: NDArray[np.float64]) -> float:
    """Gain of a loop: 1 - det(1 - slopes), which for one way around is the product of the gains on it (Mason 1956)."""
    return float(1.0 - np.linalg.det(np.eye(len(slopes)) - slopes))


def _refuse_singular(loop: "_Loop", slopes: NDArray[np.float64]) -> None:
    if not np.all(np.isfinite(slopes)):
        raise ComponentError(f"the algebraic loop {loop.operation.loop} has no finite gain at t = {loop.time:.9g} s")
    singular = np.linalg.svd(np.eye(len(slopes)) - slopes, compute_uv=False)
    if singular[-1] <= _SINGULAR * (1.0 + float(np.max(np.abs(slopes)))):
        raise ComponentError(
            f"the algebraic loop {loop.operation.loop} has no unique solution at t = {loop.time:.9g} s: "
            f"its gain is {loop_gain(slopes):.6g}; put a delay or a dynamic part into it"
        )


def _repeat(loop: "_Loop") -> None:
    """For what is no real number: go around until nothing changes."""
    for _ in range(_MOST_TURNS):
        before = [loop.coupling.values[place] for place in loop.places]
        loop.turn()
        after = [loop.coupling.values[place] for place in loop.places]
        if before == after:
            return
    raise ComponentError(
        f"the algebraic loop {loop.operation.loop} of discrete values does not settle at t = {loop.time:.9g} s; put a delay into it"
    )


class _Loop:
    """One loop at one instant."""

    def __init__(self, coupling: Carrying, operation: Solve, time: float) -> None:
        self.coupling, self.operation, self.time = coupling, operation, time
        links = [link for torn in operation.torn for link in torn.links]
        self.places = [target for link in links for target in link.targets]
        ports = [link.target.port for link in links for _ in link.targets]
        self.nominal = np.array([abs(port.nominal or 1.0) for port in ports])
        self.is_real = all(port.type == "Float64" for port in ports)

    def guess(self) -> NDArray[np.float64]:
        """The values that the torn inputs have."""
        return np.array([self.coupling.values[place] for place in self.places], dtype=float)

    def around(self, x: NDArray[np.float64]) -> NDArray[np.float64]:
        """What comes back around the loop when the torn inputs are x; they keep x."""
        values = self.coupling.values
        for place, value in zip(self.places, x.tolist(), strict=True):
            values[place] = value
        for torn in self.operation.torn:
            self.coupling.check(torn, self.time)
            self.coupling.write(torn, self.time)
        self._inside()
        back = []
        for torn in self.operation.torn:
            for link in torn.links:
                back += [link.convert(values[source]) for source in link.sources]
        return np.array(back, dtype=float)

    def turn(self) -> None:
        """Once around with the values as they come."""
        for torn in self.operation.torn:
            self.coupling.set(torn, self.time)
        self._inside()
        for torn in self.operation.torn:
            self.coupling.copy(torn.links)

    def _inside(self) -> None:
        for operation in self.operation.inside:
            if isinstance(operation, Get):
                self.coupling.get(operation, self.time)
            else:
                self.coupling.set(operation, self.time)

    def slopes(self, x: NDArray[np.float64], at: NDArray[np.float64]) -> NDArray[np.float64]:
        """g'(x), by the components' derivatives where all have them, else by differences; g(x) is `at`."""
        gets = [operation for operation in self.operation.inside if isinstance(operation, Get)]
        ports = [slot.port for operation in self.operation.inside for slot in operation.slots]
        able = all(self.coupling.components[get.component].can_differentiate for get in gets)
        columns = []
        for k in range(len(x)):
            if able and all(port.type == "Float64" and not port.shape for port in ports):
                columns.append(self._derivative(k))
            else:
                moved = x.copy()
                moved[k] += _NUDGE * max(abs(x[k]), self.nominal[k])
                columns.append((self.around(moved) - at) / (moved[k] - x[k]))
        return np.column_stack(columns)

    def _derivative(self, k: int) -> NDArray[np.float64]:
        """Column of g', carried around the loop from input to output to input."""
        moves: dict[int, float] = {self.places[k]: 1.0}
        for operation in self.operation.inside:
            if isinstance(operation, Set):
                _carry(moves, operation)
            else:
                self._through(moves, operation)
        back: list[float] = []
        for torn in self.operation.torn:
            found: dict[int, float] = dict(moves)
            _carry(found, torn)
            back += [found[target] for link in torn.links for target in link.targets]
        return np.array(back)

    def _through(self, moves: dict[int, float], operation: Get) -> None:
        component = operation.component
        inputs = [slot for slot in self.coupling.wiring.slots if slot.component == component and slot.first in moves]
        inputs = [slot for slot in inputs if slot.port.causality == "input"]
        seed: list[Any] = [moves[slot.first] for slot in inputs]
        outputs = [slot.port.name for slot in operation.slots]
        found = self.coupling.components[component].derivative(outputs, [s.port.name for s in inputs], seed)
        moves.update(zip((slot.first for slot in operation.slots), found, strict=True))


def _carry(moves: dict[int, float], operation: Set) -> None:
    for link in operation.links:
        for source, target in zip(link.sources, link.targets, strict=True):
            moves[target] = link.transfer.factor * moves.get(source, 0.0)
