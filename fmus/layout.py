"""All variables of a system in the order of their value references, with their FMI attributes."""

import math
from dataclasses import dataclass, replace
from functools import cached_property

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from fmus.symbolic.system import SymbolicSystem, Variable

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


@dataclass(frozen=True)
class Scalar:
    """A variable as FMI 2.0 sees it; its value reference is its position in the list of scalars."""

    variable: Variable
    causality: str
    variability: str
    initial: str | None = None
    derivative_of: int | None = None  # position of the state

    @property
    def has_start(self) -> bool:
        """Whether a start value has to be written."""
        return self.causality == "input" or self.initial in ("exact", "approx")


@dataclass(frozen=True)
class Layout:
    """All variables of a system in the order of their value references, as `runtime/model.h` lays it down."""

    system: SymbolicSystem

    @cached_property
    def scalars(self) -> list[Scalar]:
        """Inputs, states, derivatives, algebraics, parameters, dependents, the time and event indicators."""
        system, first_state = self.system, len(self.system.inputs)
        time = Variable("time", "s", "Time")
        return [
            *(Scalar(v, "input", "continuous") for v in system.inputs),
            *self._states(),
            *(
                Scalar(
                    derivative_variable(v),
                    "local",
                    "continuous",
                    "calculated",
                    first_state + i,
                )
                for i, v in enumerate(system.states)
            ),
            *(Scalar(v, self._shown(v), "continuous", "calculated") for v in system.algebraics),
            *(Scalar(v, "parameter", "tunable", "exact") for v in system.parameters),
            *(Scalar(v, "calculatedParameter", "tunable", "calculated") for v in system.dependents),
            Scalar(time, "independent", "continuous"),
            *(Scalar(v, "local", "continuous", "calculated") for v in self._indicators()),
        ]

    def _indicators(self) -> list[Variable]:
        relations = self.system.relations
        names = relations.names[: relations.n_indicators] if relations else ()
        return [Variable(f"eventIndicator_{i}", description=f"Event of {name}") for i, name in enumerate(names, 1)]

    def _states(self) -> list[Scalar]:
        """A start that follows from something is only a proposal, or a guess: what it follows from may change first."""
        known = start_structure(self.system).known
        defaults = [math.nan if p.start is None else p.start for p in self.system.parameters]
        starts = np.array(self.system.initial(defaults)).ravel()
        return [
            Scalar(
                replace(v, start=float(start)),
                self._shown(v),
                "continuous",
                "exact" if is_known else "approx",
            )
            for v, start, is_known in zip(self.system.states, starts, known, strict=True)
        ]

    def _shown(self, variable: Variable) -> str:
        return "output" if variable.name in self.system.outputs else "local"

    @cached_property
    def offsets(self) -> dict[str, int]:
        """Value reference of the first variable of each kind."""
        system = self.system
        kinds = {
            "inputs": len(system.inputs),
            "states": len(system.states),
            "derivatives": len(system.states),
            "algebraics": len(system.algebraics),
            "parameters": len(system.parameters),
            "dependents": len(system.dependents),
            "time": 1,
            "indicators": 0 if system.relations is None else system.relations.n_indicators,
        }
        starts = np.cumsum([0, *kinds.values()])
        return {kind: int(start) for kind, start in zip(kinds, starts, strict=False)}


def derivative_variable(state: Variable) -> Variable:
    """Describe the time derivative of a state.

    Example:
        >>> derivative_variable(Variable("w", "rad/s")).unit
        'rad/s2'
    """
    description = f"Time derivative of {state.name}"
    return Variable(f"der({state.name})", _per_second(state.unit), description)


def _per_second(unit: str) -> str:
    numerator, slash, denominator = unit.partition("/")
    if not unit or not slash:
        return f"{unit}/s" if unit else ""
    if denominator == "s":
        return f"{numerator}/s2"
    return f"{numerator}/({denominator.strip('()')}.s)"
