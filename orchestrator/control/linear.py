"""An FMU linearised at a state, by its own directional derivatives."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from orchestrator.cosim.component import Component

Array = NDArray[Any]


def linearised(
    component: Component, states: Sequence[str], inputs: Sequence[str], at: Mapping[str, float]
) -> tuple[Array, Array]:
    """A (n, n) and B (n, m) of dx = A x + B u about the values `at` of states and inputs.

    The component is initialised there and has not begun to run: it is for this alone.

    Raises:
        ComponentError: if the FMU gives no directional derivatives.
    """
    component.set(list(at), list(at.values()))
    component.initialise(0.0, None, None)
    component.start()
    component.set([name for name in inputs if name in at], [at[name] for name in inputs if name in at])
    rates = [f"der({name})" for name in states]
    columns = [component.derivative(rates, [name], [1.0]) for name in (*states, *inputs)]
    component.terminate()
    found = np.array(columns).T
    return found[:, : len(states)], found[:, len(states) :]
