"""Small systems with known solutions, written by hand in CasADi."""

import casadi as ca

from fmus.symbolic.system import SymbolicSystem, Variable

SX = ca.SX


def lag(*, delay_is_parameter: bool = True, constant_delay: float = 0.1) -> SymbolicSystem:
    """`tau der(x) = u(t - T) - x`, with `late = u(t - T)`."""
    t, x, u, d, p = symbols(states=1, inputs=1, delays=1, parameters=2)
    delay = p[1] if delay_is_parameter else SX(constant_delay)
    return SymbolicSystem(
        name="Test.Lag",
        description="First-order lag behind a delay, T < 1 s & more",
        inputs=(Variable("u", "N.m", "Drive"),),
        states=(Variable("x", "N.m", 'Lagged "drive"', nominal=2.0),),
        algebraics=(Variable("late", "N.m", minimum=-50.0, maximum=50.0),),
        parameters=(
            Variable("tau", "s", start=0.2),
            Variable("T", "s", start=constant_delay),
        ),
        dependents=(Variable("rate", "1/s"),),
        outputs=("x", "late"),
        rhs=ca.Function("rhs", [t, x, u, d, p], [(d - x) / p[0], d]),
        history=ca.Function("history", [t, u, p], [u, delay]),
        dependent=ca.Function("dependent", [p], [1 / p[0]]),
        initial=ca.Function("initial", [p], [SX(1, 1)]),
    )


def oscillator() -> SymbolicSystem:
    """`der(q) = v`, `der(v) = -2 D w0 v - w0^2 q + u`, released from rest at `q = swing/2`."""
    t, x, u, d, p = symbols(states=2, inputs=1, delays=0, parameters=3)
    w0, damping, swing = p[0], p[1], p[2]
    acceleration = -2 * damping * w0 * x[1] - w0**2 * x[0] + u
    energy = (x[1] ** 2 + (w0 * x[0]) ** 2) / 2
    return SymbolicSystem(
        name="Test.Oscillator",
        description="",
        inputs=(Variable("u", "rad/s2"),),
        states=(Variable("q", "rad"), Variable("v", "rad/s")),
        algebraics=(Variable("energy", "rad2/s2"),),
        parameters=(
            Variable("w0", "rad/s", start=3.0),
            Variable("D", "1", start=0.1),
            Variable("swing", "deg", start=1.0),
        ),
        dependents=(),
        outputs=("q",),
        rhs=ca.Function("rhs", [t, x, u, d, p], [ca.vertcat(x[1], acceleration), energy]),
        history=ca.Function("history", [t, u, p], [SX(0, 1), SX(0, 1)]),
        dependent=ca.Function("dependent", [p], [SX(0, 1)]),
        initial=ca.Function("initial", [p], [ca.vertcat(swing / 2, 0)]),
    )


def pendulum() -> SymbolicSystem:
    """`der(q) = w`, `der(w) = -9.81 sin(q) - 0.1 w`, from q = 1 rad; no inputs, no parameters."""
    t, x, u, d, p = symbols(states=2, inputs=0, delays=0, parameters=0)
    rhs = ca.vertcat(x[1], -9.81 * ca.sin(x[0]) - 0.1 * x[1])
    return without_delays("Pendulum", rhs, ("q", "w"), [1.0, 0.0], t, x, u, d, p)


def root() -> SymbolicSystem:
    """`der(x) = -sqrt(x) - 1` from 1: below x = 0 there is no derivative."""
    t, x, u, d, p = symbols(states=1, inputs=0, delays=0, parameters=0)
    return without_delays("Root", -ca.sqrt(x) - 1, ("x",), [1.0], t, x, u, d, p)


def integrator() -> SymbolicSystem:
    """`der(a) = u`, `der(b) = u(t - 0.1)`, both from 0."""
    t, x, u, d, p = symbols(states=2, inputs=1, delays=1, parameters=0)
    return SymbolicSystem(
        name="Integrator",
        description="",
        inputs=(Variable("u"),),
        states=(Variable("a"), Variable("b")),
        algebraics=(),
        parameters=(),
        dependents=(),
        outputs=("a", "b"),
        rhs=ca.Function("rhs", [t, x, u, d, p], [ca.vertcat(u, d), SX(0, 1)]),
        history=ca.Function("history", [t, u, p], [u, SX(0.1)]),
        dependent=ca.Function("dependent", [p], [SX(0, 1)]),
        initial=ca.Function("initial", [p], [SX.zeros(2)]),
    )


def without_delays(name, rhs, states, start, t, x, u, d, p) -> SymbolicSystem:  # type: ignore[no-untyped-def]
    """An autonomous system that shows all its states."""
    return SymbolicSystem(
        name=name,
        description="",
        inputs=(),
        states=tuple(Variable(state) for state in states),
        algebraics=(),
        parameters=(),
        dependents=(),
        outputs=tuple(states),
        rhs=ca.Function("rhs", [t, x, u, d, p], [rhs, SX(0, 1)]),
        history=ca.Function("history", [t, u, p], [SX(0, 1), SX(0, 1)]),
        dependent=ca.Function("dependent", [p], [SX(0, 1)]),
        initial=ca.Function("initial", [p], [ca.DM(start)]),
    )


def symbols(*, states: int, inputs: int, delays: int, parameters: int) -> tuple[SX, ...]:
    """t, x, u, d and p as columns."""
    sizes = {"x": states, "u": inputs, "d": delays, "p": parameters}
    return (SX.sym("t"), *(SX.sym(name, size) for name, size in sizes.items()))
