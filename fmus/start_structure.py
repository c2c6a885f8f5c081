"""What the start value of each state follows from."""

from dataclasses import dataclass

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from fmus.symbolic.system import SymbolicSystem

Mask = NDArray[np.bool_]


@dataclass(frozen=True)
class StartStructure:
    """Dependencies of the start values of n states, one row each.

    `known` (n,) marks those that follow from nothing: they can be set, and others may depend on them (`states`).
    """

    known: Mask
    time: Mask  # (n,)
    inputs: Mask  # (n, n_inputs)
    parameters: Mask  # (n, n_parameters)
    states: Mask  # (n, n)


def start_structure(system: SymbolicSystem) -> StartStructure:
    """Work out the dependencies from the structure of the Jacobians."""
    n = len(system.states)
    declared = sparsity(system.initial, 0, 0)
    if system.consistent is None:
        known = np.asarray(~declared.any(axis=1))
        inputs = np.zeros((n, len(system.inputs)), dtype=bool)
        return StartStructure(known, np.zeros(n, dtype=bool), inputs, declared, np.diag(known))
    time, inputs, parameters, proposed = (sparsity(system.consistent, 0, i) for i in range(4))
    others = np.hstack([time, inputs, parameters, proposed & ~np.eye(n, dtype=bool), declared])
    known = np.asarray(proposed.diagonal() & ~others.any(axis=1))
    return StartStructure(known, time.ravel(), inputs, parameters | proposed @ declared, proposed & known[None, :])


def sparsity(function: ca.Function, output: int, argument: int) -> Mask:
    """Structural Jacobian of one output by one argument, (n_output, n_argument)."""
    pattern = np.array(ca.DM(function.jac_sparsity(output, argument), 1)) != 0
    return pattern.reshape(function.numel_out(output), function.numel_in(argument))
