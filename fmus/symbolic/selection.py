"""Which variables stay states when rigid couplings take degrees of freedom away."""

from collections.abc import Mapping, Sequence

import casadi as ca
import numpy as np

from fmus.errors import ModelicaError
from fmus.symbolic.dae import Quantity, column

SELECT = {"never": 0, "avoid": 1, "default": 2, "prefer": 3, "always": 4}
# Below this share of its column a coefficient counts as zero.
SMALL = 1e-8

Preference = tuple[int, ...]


def preference(quantity: Quantity | None, symbol: ca.SX) -> Preference:
    """How much a variable asks to be a state: what was declared about it, then how short its name is."""
    if quantity is None:
        return (SELECT["default"], 0, 0, 0, 0, -symbol.name().count("."))
    return (
        SELECT[quantity.select],
        1,
        int(quantity.derivative is not None),
        int(quantity.fixed is True),
        int(quantity.start is not None),
        -symbol.name().count("."),
    )


def choose_dummies(
    residuals: Sequence[ca.SX],
    rates: Sequence[ca.SX],
    preferences: Sequence[Preference],
    values: Mapping[int, float],
    places: Sequence[str],
) -> list[int]:
    """Choose as many derivatives as there are equations, such that the equations can be solved for them.

    Derivatives of the least preferred variables are taken first; among equals those with the largest coefficients at
    the start. A choice that is singular at the start is avoided where there is another.

    Args:
        residuals: the equations, each zero where it holds.
        rates: derivatives, as symbols.
        preferences: how much each of their variables should stay a state.
        values: numbers of symbols at the start, by their hash.
        places: file and line of each equation, for messages.

    Returns:
        Positions among `rates`.

    Raises:
        ModelicaError: if the equations depend on each other.
    """
    jacobian = ca.jacobian(column(residuals), column(rates))
    at_start, elsewhere = _Span(_evaluated(jacobian, values, 0.0)), _Span(_evaluated(jacobian, values, 1.0))
    chosen: list[int] = []
    # What is independent elsewhere only is singular at the start, and taken when nothing else is left.
    for spans in ((at_start, elsewhere), (elsewhere,)):
        for level in sorted(set(preferences)):
            group = {k for k in range(len(rates)) if preferences[k] == level and k not in chosen}
            while len(chosen) < len(residuals):
                news = {k: min(span.new_share(k) for span in spans) for k in group}
                group = {k for k in group if news[k] > SMALL}
                if not group:
                    break
                best = max(sorted(group), key=spans[0].new_part)
                for span in spans:
                    span.take(best)
                group.remove(best)
                chosen.append(best)
    if len(chosen) < len(residuals):
        where = ", ".join(sorted({place for place in places if place}))
        raise ModelicaError(f"the coupling equations at {where} depend on each other; remove one of them")
    return chosen


class _Span:
    """The space of the columns chosen so far, and what the others would add to it."""

    def __init__(self, matrix: np.ndarray) -> None:
        self._lengths = np.linalg.norm(matrix, axis=0)
        self._rest = matrix.copy()

    def new_share(self, k: int) -> float:
        """How much of a column is new, between 0 and 1; 0 for an empty one or one that is no number."""
        length = float(self._lengths[k])
        return self.new_part(k) / length if length > 0.0 and np.isfinite(length) else 0.0

    def new_part(self, k: int) -> float:
        """Length of what is new in a column."""
        return float(np.linalg.norm(self._rest[:, k]))

    def take(self, k: int) -> None:
        direction = self._rest[:, k] / np.linalg.norm(self._rest[:, k])
        for _ in range(2):  # the second pass removes the rounding of the first
            self._rest -= np.outer(direction, direction @ self._rest)


def _evaluated(matrix: ca.SX, values: Mapping[int, float], spread: float) -> np.ndarray:
    """A matrix at the start, or at random around it; derivatives that are not known are zero at the start."""
    random = np.random.default_rng(0)
    symbols = ca.symvar(matrix)
    numbers = [values.get(int(s.element_hash()), 0.0) + spread * random.uniform(0.2, 0.9) for s in symbols]
    function = ca.Function("matrix", [column(symbols)], [ca.densify(matrix)])
    return np.array(function(ca.DM(numbers) if numbers else ca.DM(0, 1))).reshape(matrix.shape)
