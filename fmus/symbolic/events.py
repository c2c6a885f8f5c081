"""Relations that make events in an FMU: `x > 1` outside `noEvent` and `smooth`."""

from typing import Any

import casadi as ca

from fmus.symbolic.system import Relations, SymbolicSystem


def without_relations(system: SymbolicSystem) -> Relations:
    """Describe the relations of a system that has none."""
    rhs = system.rhs
    symbol = ca.SX.sym if rhs.is_a("SXFunction") else ca.MX.sym
    arguments: list[Any] = [symbol(rhs.name_in(i), rhs.numel_in(i)) for i in range(rhs.n_in())]
    sides: Any = symbol("c", 0)
    shaped = [ca.reshape(argument, *rhs.size_in(i)) for i, argument in enumerate(arguments)]
    none = ca.SX(0, 1)
    places = [ca.SX.sym("p", rhs.numel_in(i)) for i in range(rhs.n_in())]
    return Relations(
        names=(),
        holds_at_zero=(),
        rhs=ca.Function("rhs", [*arguments, sides], rhs.call(shaped)),
        indicators=ca.Function("indicators", [*places, ca.SX.sym("c", 0)], [none, none]),
        times=ca.Function("times", [places[-1]], [none, none]),
    )
