"""Correction residuals: the generalised force that would make a model follow a measurement.

A model offers an input `correction_<output>` for each output. Where the output reads a position, the residual is the
force that gives the measured acceleration; where it reads a state that the correction moves directly (a level, moved by
a flow), it is the flow that gives the measured rate; where the correction acts on the output itself, it is the
difference. States that are not measured (an activation, say) are simulated along the measured ones.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import casadi as ca

from fmus.symbolic.balances import Balance
from fmus.symbolic.system import SymbolicSystem, Variable

PREFIX = "correction_"


@dataclass(frozen=True)
class Position:
    """A signal that reads a state: signal = scale * state + offset.

    Of a position, der(state) is the state `speed`. Of a state of first order, `speed` is None: its correction acts on
    der(state) itself. `scale` and `offset` are functions of all parameters; they differ from 1 and 0 if a sensor error
    is in the model.
    """

    state: str
    speed: str | None
    scale: ca.Function
    offset: ca.Function


@dataclass(frozen=True)
class ResidualSystem:
    """The residual as a system of its own.

    Its inputs are the model's, without corrections; then `measured:<signal>` of each signal that reads a state, and
    `speed:<signal>` (first derivative) if that is a position; then `target:<signal>`: the measured second derivative of
    a position, the first derivative of a state of first order, the measured value of another signal. Its states are the
    model's states that are not measured; its outputs are `residual:<signal>`.
    """

    system: SymbolicSystem
    signals: tuple[str, ...]
    positions: Mapping[str, Position]


def with_corrections(system: SymbolicSystem, balances: Sequence[Balance]) -> SymbolicSystem:
    """The system with the inputs at its balances as corrections: each of the output that shows what the balance drives.

    An output that reads a position goes before one that reads its speed; where no output reads either, the correction
    bears the state's name.
    """
    names: dict[str, str] = {}
    if system.rhs.is_a("SXFunction"):
        symbols = _Symbols(system)
        read = {state: name for name in reversed(system.outputs) for state, *_ in symbols.read_by(name)}
        for balance in balances:
            shown = next((read[state] for state in (balance.position, balance.state) if state in read), balance.state)
            names[balance.input] = PREFIX + shown
    return replace(system, inputs=tuple(replace(v, name=names.get(v.name, v.name)) for v in system.inputs))


def residual_system(system: SymbolicSystem, signals: Sequence[str]) -> ResidualSystem | None:
    """Derive the correction residual of a model from its equations.

    With accelerations dw = f(x, u) + G c of the measured positions under corrections c, the residual is
    c = G^-1 (measured acceleration - f); with dx = f(x, u) + G c of measured states of first order it is
    G^-1 (measured rate - f); for a signal y = h(x, u) + c it is measured - h. Without inputs `correction_<signal>` the
    residual is the difference itself, an acceleration for positions.

    Returns:
        None if some signal is neither a position nor directly under a correction, itself or its rate, if two signals read one
        state (a position and the force of a spring on it), or if equations of the model are solved by iteration, whose results have no formula to read positions and forces from.
    """
    if not system.rhs.is_a("SXFunction"):
        return None
    symbols = _Symbols(system)
    positions = {name: found for name in signals if (found := symbols.reading(name)) is not None}
    if len({position.state for position in positions.values()}) < len(positions):
        return None
    targets = {name: ca.SX.sym(f"target:{name}") for name in signals}
    balance = []
    for name in signals:
        force = symbols.inputs.get(PREFIX + name)
        if name in positions:
            scale, moved = positions[name].scale(symbols.parameters), positions[name].speed or positions[name].state
            balance.append(symbols.derivatives[moved] - targets[name] / scale)
        elif force is not None and ca.depends_on(symbols.values[name], force):
            balance.append(symbols.values[name] - targets[name])
        else:
            return None
    residual = _solve(ca.vertcat(*balance), [symbols.inputs.get(PREFIX + name) for name in signals])
    return ResidualSystem(_reduced(symbols, residual, positions, targets), tuple(signals), positions)


class _Symbols:
    """The symbols of a system by name, and its right-hand side in them."""

    def __init__(self, system: SymbolicSystem) -> None:
        self.system = system
        self.time, self.parameters = ca.SX.sym("t"), ca.SX.sym("p", len(system.parameters))
        self.x, self.u = ca.SX.sym("x", len(system.states)), ca.SX.sym("u", len(system.inputs))
        self.delayed = ca.SX.sym("d", system.n_delays)
        dx, z = system.rhs(self.time, self.x, self.u, self.delayed, self.parameters)
        self.inputs = {v.name: self.u[i] for i, v in enumerate(system.inputs)}
        self.derivatives = {v.name: dx[i] for i, v in enumerate(system.states)}
        self.states = {v.name: self.x[i] for i, v in enumerate(system.states)}
        self.values = self.states | {v.name: z[i] for i, v in enumerate(system.algebraics)}

    def read_by(self, signal: str) -> Iterator[tuple[str, ca.SX, ca.SX]]:
        """States that a signal is a linear function of, with scale and offset."""
        value = self.values[signal]
        others = ca.vertcat(self.time, self.u, self.delayed)
        for state, symbol in self.states.items():
            scale, offset = ca.jacobian(value, symbol), ca.substitute(value, symbol, ca.SX(0))
            free = ca.vertcat(scale, offset)
            if not (scale.is_zero() or ca.depends_on(free, self.x) or ca.depends_on(free, others)):
                yield state, scale, offset

    def reading(self, signal: str) -> Position | None:
        """Find the state that a signal reads, if its derivative is a state too or under the signal's correction; else None."""
        for state, scale, offset in self.read_by(signal):
            speeds = [name for name, v in self.states.items() if ca.is_equal(self.derivatives[state], v)]
            force = self.inputs.get(PREFIX + signal)
            if speeds or (force is not None and ca.depends_on(self.derivatives[state], force)):
                functions = (ca.Function("map", [self.parameters], [part]) for part in (scale, offset))
                return Position(state, speeds[0] if speeds else None, *functions)
        return None


def _reduced(
    symbols: _Symbols, residual: ca.SX, positions: Mapping[str, Position], targets: Mapping[str, ca.SX]
) -> SymbolicSystem:
    """The system whose outputs are the residuals: measured states replaced, corrections zero."""
    system, p = symbols.system, symbols.parameters
    old: list[ca.SX] = []
    new: list[ca.SX] = []
    inputs: list[tuple[Variable, ca.SX]] = [
        (v, symbols.inputs[v.name]) for v in system.inputs if not v.name.startswith(PREFIX)
    ]
    for name, position in positions.items():
        value, speed = ca.SX.sym(f"measured:{name}"), ca.SX.sym(f"speed:{name}")
        scale, offset = position.scale(p), position.offset(p)
        inputs.append((Variable(value.name()), value))
        old.append(symbols.states[position.state])
        new.append((value - offset) / scale)
        if position.speed is not None:
            inputs.append((Variable(speed.name()), speed))
            old.append(symbols.states[position.speed])
            new.append(speed / scale)
    inputs += [(Variable(target.name()), target) for target in targets.values()]
    corrections = [symbols.inputs[v.name] for v in system.inputs if v.name.startswith(PREFIX)]
    old, new = old + corrections, new + [ca.SX(0)] * len(corrections)
    measured = {name for position in positions.values() for name in (position.state, position.speed)}
    hidden = [i for i, v in enumerate(system.states) if v.name not in measured]
    dx = _column([symbols.derivatives[system.states[i].name] for i in hidden])
    dx, residual = ca.substitute([dx, residual], old, new) if old else (dx, residual)
    source, delay = system.history(symbols.time, symbols.u, p)
    u, start = _column([symbol for _, symbol in inputs]), system.initial(p)
    return SymbolicSystem(
        name=f"the residual of {system.name}",
        description="",
        inputs=tuple(variable for variable, _ in inputs),
        states=tuple(system.states[i] for i in hidden),
        algebraics=tuple(Variable(f"residual:{name}") for name in targets),
        parameters=system.parameters,
        dependents=system.dependents,
        outputs=tuple(f"residual:{name}" for name in targets),
        rhs=ca.Function(
            "rhs", [symbols.time, _column([symbols.x[i] for i in hidden]), u, symbols.delayed, p], [dx, residual]
        ),
        history=ca.Function("history", [symbols.time, u, p], [source, delay]),
        dependent=system.dependent,
        initial=ca.Function("initial", [p], [_column([start[i] for i in hidden])]),
    )


def _solve(balance: ca.SX, forces: Sequence[ca.SX | None]) -> ca.SX:
    """Forces that make the balance zero; it is affine in them. Without a full set, minus the balance itself."""
    known = [force for force in forces if force is not None]
    if len(known) < len(forces):
        return -balance
    unknown = ca.vertcat(*known)
    gain = ca.jacobian(balance, unknown)
    return -ca.solve(gain, ca.substitute(balance, unknown, ca.DM.zeros(len(known))))


def _column(scalars: Sequence[ca.SX]) -> ca.SX:
    return ca.vertcat(ca.SX(0, 1), *scalars)
