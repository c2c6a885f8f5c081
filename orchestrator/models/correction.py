"""Correction residuals: the generalised force that would make a model follow a measurement.

A model offers an input `correction_<output>` for each output. Where the output is a position, the residual is the
force that gives the measured acceleration; where the force acts on the output itself, it is the difference. States
that are not measured (an activation, say) are simulated along the measured ones.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import casadi as ca

from fmus.symbolic.system import SymbolicSystem, Variable

PREFIX = "correction_"


@dataclass(frozen=True)
class ResidualSystem:
    """The residual as a system of its own.

    Its inputs are the model's, without corrections, then `measured:<state>` for the states of positions and their
    speeds, then `target:<signal>`: the measured acceleration of a position, the measured value of another signal.
    Its states are the model's states that are not measured; its outputs are `residual:<signal>`.
    `positions` maps each signal that is a position to the names of its state and of its speed.
    """

    system: SymbolicSystem
    signals: tuple[str, ...]
    positions: Mapping[str, tuple[str, str]]


def residual_system(system: SymbolicSystem, signals: Sequence[str]) -> ResidualSystem | None:
    """Derive the correction residual of a model from its equations.

    With accelerations dw = f(x, u) + G c of the measured positions under corrections c, the residual is
    c = G^-1 (measured acceleration - f); for a signal y = h(x, u) + c it is measured - h. Without inputs
    `correction_<signal>` the residual is the difference itself, an acceleration for positions.

    Returns:
        None if some signal is neither a position nor directly under a correction.
    """
    symbols = _Symbols(system)
    positions = {name: pair for name in signals if (pair := symbols.position_and_speed(name)) is not None}
    targets = [ca.SX.sym(f"target:{name}") for name in signals]
    balance = []
    for name, target in zip(signals, targets, strict=True):
        force = symbols.inputs.get(PREFIX + name)
        if name in positions:
            balance.append(symbols.derivatives[positions[name][1]] - target)
        elif force is not None and ca.depends_on(symbols.values[name], force):
            balance.append(symbols.values[name] - target)
        else:
            return None
    residual = _solve(ca.vertcat(*balance), [symbols.inputs.get(PREFIX + name) for name in signals])
    measured = [state for pair in positions.values() for state in pair]
    hidden = [v for v in system.states if v.name not in measured]
    kept = [v for v in system.inputs if not v.name.startswith(PREFIX)]
    u = ca.vertcat(
        ca.SX(0, 1),
        *[symbols.inputs[v.name] for v in kept],
        *[symbols.values[name] for name in measured],
        *targets,
    )
    x = ca.vertcat(ca.SX(0, 1), *[symbols.values[v.name] for v in hidden])
    dx = ca.vertcat(ca.SX(0, 1), *[symbols.derivatives[v.name] for v in hidden])
    none = [symbols.inputs[v.name] for v in system.inputs if v.name.startswith(PREFIX)]
    dx, residual = ca.substitute([dx, residual], none, [ca.SX(0)] * len(none)) if none else (dx, residual)
    t, d, p = symbols.time, symbols.delayed, symbols.parameters
    source, delay = system.history(t, symbols.u, p)
    start = system.initial(p)
    first = ca.vertcat(ca.SX(0, 1), *[start[i] for i, v in enumerate(system.states) if v.name not in measured])
    return ResidualSystem(
        SymbolicSystem(
            name=f"the residual of {system.name}",
            description="",
            inputs=(*kept, *(Variable(f"measured:{n}") for n in measured), *(Variable(f"target:{n}") for n in signals)),
            states=tuple(hidden),
            algebraics=tuple(Variable(f"residual:{name}") for name in signals),
            parameters=system.parameters,
            dependents=system.dependents,
            outputs=tuple(f"residual:{name}" for name in signals),
            rhs=ca.Function("rhs", [t, x, u, d, p], [dx, residual]),
            history=ca.Function("history", [t, u, p], [source, delay]),
            dependent=system.dependent,
            initial=ca.Function("initial", [p], [first]),
        ),
        tuple(signals),
        positions,
    )


class _Symbols:
    """The symbols of a system by name, and its right-hand side in them."""

    def __init__(self, system: SymbolicSystem) -> None:
        self.time, self.parameters = ca.SX.sym("t"), ca.SX.sym("p", len(system.parameters))
        self.x, self.u = ca.SX.sym("x", len(system.states)), ca.SX.sym("u", len(system.inputs))
        self.delayed = ca.SX.sym("d", system.n_delays)
        dx, z = system.rhs(self.time, self.x, self.u, self.delayed, self.parameters)
        self.inputs = {v.name: self.u[i] for i, v in enumerate(system.inputs)}
        self.derivatives = {v.name: dx[i] for i, v in enumerate(system.states)}
        self.states = {v.name: self.x[i] for i, v in enumerate(system.states)}
        self.values = self.states | {v.name: z[i] for i, v in enumerate(system.algebraics)}

    def position_and_speed(self, signal: str) -> tuple[str, str] | None:
        """Names of the state that a signal equals, and of the state that is its derivative; None without them."""
        for position, symbol in self.states.items():
            if ca.is_equal(self.values[signal], symbol):
                for speed, candidate in self.states.items():
                    if ca.is_equal(self.derivatives[position], candidate):
                        return position, speed
        return None


def _solve(balance: ca.SX, forces: Sequence[ca.SX | None]) -> ca.SX:
    """Forces that make the balance zero; it is affine in them. Without a full set, minus the balance itself."""
    known = [force for force in forces if force is not None]
    if len(known) < len(forces):
        return -balance
    unknown = ca.vertcat(*known)
    gain = ca.jacobian(balance, unknown)
    return -ca.solve(gain, ca.substitute(balance, unknown, ca.DM.zeros(len(known))))
