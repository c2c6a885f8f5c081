"""Small systems with events and known solutions, written by hand in CasADi."""

from collections.abc import Sequence

import casadi as ca
from helpers_systems import symbols

from fmus.symbolic.system import Relations, SymbolicSystem, Variable

SX = ca.SX


def system(
    name: str,
    symbol: tuple[SX, ...],
    sides: SX,
    dx: SX,
    z: SX,
    differences: Sequence[SX],
    start: Sequence[float],
    *,
    times: SX | None = None,
    rising: Sequence[float] = (),
) -> SymbolicSystem:
    """States x1.., inputs u1.., parameters p1.. (all 1), outputs z1..; a relation holds where its difference is > 0."""
    t, x, u, d, p = symbol
    start_sides = ca.DM.zeros(sides.numel())
    plain = [ca.substitute(SX(difference > 0), sides, start_sides) for difference in differences]
    plain += [SX((t >= times[i]) == rise) for i, rise in enumerate(rising)] if times is not None else []
    standing = ca.substitute([dx, z], [sides], [ca.vertcat(*plain)])
    g = ca.vertcat(SX(0, 1), *differences)
    late = SX(0, 1) if times is None else times
    return SymbolicSystem(
        name=name,
        description="",
        inputs=tuple(Variable(f"u{i + 1}") for i in range(u.numel())),
        states=tuple(Variable(f"x{i + 1}") for i in range(x.numel())),
        algebraics=tuple(Variable(f"z{i + 1}") for i in range(z.numel())),
        parameters=tuple(Variable(f"p{i + 1}", start=1.0) for i in range(p.numel())),
        dependents=(),
        outputs=tuple(f"z{i + 1}" for i in range(z.numel())),
        rhs=ca.Function("rhs", [t, x, u, d, p], standing),
        history=ca.Function("history", [t, u, p], [SX(0, 1), SX(0, 1)]),
        dependent=ca.Function("dependent", [p], [SX(0, 1)]),
        initial=ca.Function("initial", [p], [ca.DM(start) if start else SX(0, 1)]),
        relations=Relations(
            names=tuple(f"relation {i + 1}" for i in range(sides.numel())),
            holds_at_zero=(False,) * len(differences),
            rhs=ca.Function("rhs", [t, x, u, d, p, sides], [dx, z]),
            indicators=ca.Function("indicators", [t, x, u, d, p, sides], [g, ca.fabs(g)]),
            times=ca.Function("times", [p], [late, ca.DM(rising) if rising else SX(0, 1)]),
        ),
    )


def tank() -> SymbolicSystem:
    """`der(x) = 1` up to x = 1, then `-2 (x - 2)`: x = t, later x = 2 - exp(-2 (t - 1)); z = x."""
    symbol = symbols(states=1, inputs=0, delays=0, parameters=0)
    x, c = symbol[1], SX.sym("c", 1)
    return system("Tank", symbol, c, ca.if_else(c, 1.0, 2 * (2 - x)), x, [1 - x], [0.0])


def contact() -> SymbolicSystem:
    """A mass of 1 kg falling by 10 m/s2 from 1 m onto a spring of 1e4 N/m at height 0; z is its energy."""
    symbol = symbols(states=2, inputs=0, delays=0, parameters=0)
    x, c = symbol[1], SX.sym("c", 1)
    force = ca.if_else(c, -1e4 * x[0], 0.0)
    energy = x[1] ** 2 / 2 + 10 * x[0] + ca.if_else(c, 5e3 * x[0] ** 2, 0.0)
    return system("Contact", symbol, c, ca.vertcat(x[1], force - 10), energy, [-x[0]], [1.0, 0.0])


def relay() -> SymbolicSystem:
    """`der(x) = 1 if u > x else -1` for x in [0, u]; z = u - x, an input decides."""
    symbol = symbols(states=1, inputs=1, delays=0, parameters=0)
    x, u, c = symbol[1], symbol[2], SX.sym("c", 1)
    return system("Relay", symbol, c, ca.if_else(c, 1.0, -0.5), u - x, [u], [0.0])


def sliding() -> SymbolicSystem:
    """`der(x) = -1 if x > 0 else 1`: arrives at 0 and can leave it on neither side."""
    symbol = symbols(states=1, inputs=0, delays=0, parameters=0)
    x, c = symbol[1], SX.sym("c", 1)
    return system("Sliding", symbol, c, ca.if_else(c, -1.0, 1.0), x, [x], [0.5])


def pulse() -> SymbolicSystem:
    """`der(x) = 1` from t = p1 to t = p1 + 1e-3, else 0; z is 1 within the pulse."""
    symbol = symbols(states=1, inputs=0, delays=0, parameters=1)
    p, c = symbol[4], SX.sym("c", 2)
    inside = c[0] * c[1]
    times = ca.vertcat(p, p + 1e-3)
    return system("Pulse", symbol, c, inside, inside, [], [0.0], times=times, rising=[1.0, 0.0])


def undecided() -> SymbolicSystem:
    """`z = 1 if z < 0.5 else 0`: no side is consistent."""
    symbol = symbols(states=0, inputs=0, delays=0, parameters=0)
    c = SX.sym("c", 1)
    z = ca.if_else(c, 1.0, 0.0)
    return system("Undecided", symbol, c, SX(0, 1), z, [0.5 - z], [])
