"""Which variable depends on which: the dependencies that a model description declares."""

from dataclasses import dataclass

import numpy as np

from fmus.layout import Layout, Mask, sparsity, start_structure
from fmus.symbolic.system import SymbolicSystem


@dataclass(frozen=True)
class ModelStructure:
    """Dependencies by value reference: each unknown with all knowns that it may depend on.

    While running, inputs, states and the time are known; at the start inputs, parameters, the time
    and those start values that do not follow from parameters.
    """

    outputs: dict[int, list[int]]
    derivatives: dict[int, list[int]]
    initial_unknowns: dict[int, list[int]]


@dataclass(frozen=True)
class _Knowns:
    """Structural dependencies of the derivatives, then the algebraic variables, one row each."""

    time: Mask  # (n,)
    states: Mask  # (n, n_states)
    inputs: Mask  # (n, n_inputs)
    parameters: Mask  # (n, n_parameters)


def model_structure(layout: Layout) -> ModelStructure:
    """Work out all dependencies from the structure of the Jacobians."""
    system, offsets = layout.system, layout.offsets
    now = _knowns(system, _instant_delays(system))
    references = {s.variable.name: reference for reference, s in enumerate(layout.scalars)}
    outputs = {}
    for reference in (references[name] for name in system.outputs):
        is_state = reference < offsets["derivatives"]
        row = reference - offsets["derivatives"]
        outputs[reference] = [reference] if is_state else _while_running(layout, now, row)
    derivatives = {offsets["derivatives"] + row: _while_running(layout, now, row) for row in range(len(system.states))}
    return ModelStructure(outputs, derivatives, _initial_unknowns(layout))


def _instant_delays(system: SymbolicSystem) -> Mask:
    """Delay operators that may let the present through: all but those with a positive constant delay."""
    varies = np.zeros(system.n_delays, dtype=bool)
    for argument in range(system.history.n_in()):
        varies |= sparsity(system.history, 1, argument).any(axis=1)
    arguments = [np.zeros(system.history.size_in(i)) for i in range(system.history.n_in())]
    delays = np.array(system.history(*arguments)[1]).ravel()
    return np.asarray(varies | (delays <= 0.0))


def _knowns(system: SymbolicSystem, instant: Mask) -> _Knowns:
    """Direct dependencies, and those through the delay operators that are `instant`."""
    time, states, inputs, delayed, parameters = (_rhs_sparsity(system, i) for i in range(5))
    through = delayed & instant[None, :]
    source_time, source_inputs, source_parameters = (sparsity(system.history, 0, i) for i in range(3))
    return _Knowns(
        time=(time | through @ source_time).ravel(),
        states=states,
        inputs=inputs | through @ source_inputs,
        parameters=parameters | through @ source_parameters,
    )


def _rhs_sparsity(system: SymbolicSystem, argument: int) -> Mask:
    """What is read now, and what relations read, which keep their side until an event."""
    now, evaluated = (
        np.vstack([sparsity(rhs, output, argument) for output in (0, 1)]) for rhs in (system.between_events, system.rhs)
    )
    return np.asarray(now | evaluated)


def _initial_unknowns(layout: Layout) -> dict[int, list[int]]:
    system, offsets = layout.system, layout.offsets
    # At the start nothing is in the past yet: a delay operator gives the present value.
    start = _knowns(system, np.ones(system.n_delays, dtype=bool))
    initial: dict[int, list[int]] = {}
    starts = start_structure(system)
    for i in range(len(system.states)):
        if not starts.known[i]:
            initial[offsets["states"] + i] = _start_of(layout, np.arange(len(system.states)) == i)
    for row in range(len(system.states) + len(system.algebraics)):
        reference = offsets["derivatives"] + row
        if row < len(system.states) or layout.scalars[reference].causality == "output":
            initial[reference] = _while_starting(layout, start, row)
    for i, needed in enumerate(sparsity(system.dependent, 0, 0)):
        initial[offsets["dependents"] + i] = _columns(needed, offsets["parameters"])
    return initial


def _while_running(layout: Layout, knowns: _Knowns, row: int) -> list[int]:
    offsets = layout.offsets
    time = [offsets["time"]] if knowns.time[row] else []
    states = _columns(knowns.states[row], offsets["states"])
    return _columns(knowns.inputs[row], offsets["inputs"]) + states + time


def _while_starting(layout: Layout, knowns: _Knowns, row: int) -> list[int]:
    """States whose start follows from something stand for what it follows from."""
    direct = _Knowns(*(mask[row] for mask in (knowns.time, knowns.states, knowns.inputs, knowns.parameters)))
    return _start_of(layout, knowns.states[row], direct)


def _start_of(layout: Layout, used: Mask, direct: _Knowns | None = None) -> list[int]:
    """What the starts of the `used` states follow from, and what is used directly."""
    offsets, starts = layout.offsets, start_structure(layout.system)
    time, inputs, parameters, states = (
        np.asarray(mask[used].any(axis=0)) for mask in (starts.time, starts.inputs, starts.parameters, starts.states)
    )
    if direct is not None:
        time, inputs, parameters = time | direct.time, inputs | direct.inputs, parameters | direct.parameters
    at_time = [offsets["time"]] if time else []
    rest = _columns(parameters, offsets["parameters"]) + at_time
    return _columns(inputs, offsets["inputs"]) + _columns(states, offsets["states"]) + rest


def _columns(mask: Mask, offset: int) -> list[int]:
    return [offset + int(column) for column in np.flatnonzero(mask)]
