"""Which variable depends on which: the dependencies that a model description declares."""

from collections.abc import Iterable
from dataclasses import dataclass

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from fmus.symbolic.system import SymbolicSystem

Mask = NDArray[np.bool_]


@dataclass(frozen=True)
class Knowns:
    """Structural dependencies of some unknowns, one row each: on the time and on columns of knowns."""

    time: Mask  # (n,)
    states: Mask  # (n, n_states)
    inputs: Mask  # (n, n_inputs)
    parameters: Mask  # (n, n_parameters)


def running(system: SymbolicSystem) -> Knowns:
    """Dependencies of the derivatives and algebraic variables (in this order) during a step.

    A delayed value depends on the present only where its delay may be zero, that is where the delay is
    not a positive constant.
    """
    delay_moves = _any_row(
        [sparsity(system.history, 1, i) for i in range(3)], system.n_delays
    )
    delays = np.array(system.history(*_zeros(system.history))[1]).ravel()
    instant = delay_moves | (delays <= 0.0)
    return _knowns(system, instant)


def at_start(system: SymbolicSystem) -> Knowns:
    """Dependencies of the derivatives and algebraic variables at the start, where nothing is delayed yet."""
    return _knowns(system, np.ones(system.n_delays, dtype=bool))


def sparsity(function: ca.Function, output: int, argument: int) -> Mask:
    """Structural Jacobian of one output by one argument, (n_output, n_argument)."""
    pattern = np.array(ca.DM(function.jac_sparsity(output, argument), 1)) != 0
    return pattern.reshape(function.numel_out(output), function.numel_in(argument))


def _knowns(system: SymbolicSystem, instant: Mask) -> Knowns:
    time, states, inputs, delayed, parameters = (_rhs(system, i) for i in range(5))
    through = delayed & instant[None, :]
    source_time, source_inputs, source_parameters = (
        sparsity(system.history, 0, i) for i in range(3)
    )
    return Knowns(
        time=(time | _chain(through, source_time)).ravel(),
        states=states,
        inputs=inputs | _chain(through, source_inputs),
        parameters=parameters | _chain(through, source_parameters),
    )


def _rhs(system: SymbolicSystem, argument: int) -> Mask:
    return np.vstack([sparsity(system.rhs, output, argument) for output in (0, 1)])


def _chain(outer: Mask, inner: Mask) -> Mask:
    return (outer.astype(int) @ inner.astype(int)) > 0


def _any_row(masks: Iterable[Mask], n_rows: int) -> Mask:
    result = np.zeros(n_rows, dtype=bool)
    for mask in masks:
        result |= mask.any(axis=1)
    return result


def _zeros(function: ca.Function) -> list[ca.DM]:
    return [ca.DM.zeros(*function.size_in(i)) for i in range(function.n_in())]
