"""What a physics model expects of learned functions, as their prior means."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from fmus.errors import MisfitError
from fmus.symbolic.system import SymbolicSystem
from orchestrator.measurements.wording import nearest

Array = NDArray[Any]


@dataclass(frozen=True, eq=False)
class PriorMean:
    """A prior mean with its exact gradient: `mean` maps points (n, d) to (n, p), `gradient` to (n, p, d)."""

    mean: Callable[[Array], Array]
    gradient: Callable[[Array], Array]


def prior_means(
    system: SymbolicSystem, values: Sequence[str], states: Sequence[str], factors: Sequence[str]
) -> tuple[PriorMean, tuple[PriorMean, ...]]:
    """What a model says of `values` where all factors are 0, and what each factor adds at 1.

    For a muscle model, `values` are joint torques and factors activations: the first are the statics, the others capabilities.

    Args:
        values: variables of the model, (p,).
        states: (d,) states that the functions depend on, in the order of the points' columns; others keep their start values.
        factors: inputs of the model; all inputs without a place here are 0.

    Raises:
        MisfitError: if a name is not there, or the model's equations are solved by iteration or look back in time.
    """
    if not system.rhs.is_a("SXFunction") or system.n_delays:
        raise MisfitError(f"{system.name} has no closed formula; expected a model without iterations and delays")
    x, at = _symbols(system, states)
    u = ca.SX.sym("u", len(system.inputs))
    p = ca.DM([parameter.start or 0.0 for parameter in system.parameters])
    dx, z = system.rhs(0, at, u, ca.SX(0, 1), p)
    named = {v.name: z[i] for i, v in enumerate(system.algebraics)}
    named |= {v.name: at[i] for i, v in enumerate(system.states)}
    seen = ca.vertcat(*[_found(named, name, system.name) for name in values])
    inputs = {v.name: i for i, v in enumerate(system.inputs)}
    rest = ca.substitute(seen, u, ca.DM.zeros(len(inputs)))
    parts = []
    for name in factors:
        one = ca.DM.zeros(len(inputs))
        one[_found(inputs, name, system.name)] = 1.0
        parts.append(_prior(x, ca.substitute(seen, u, one) - rest))
    return _prior(x, rest), tuple(parts)


def _symbols(system: SymbolicSystem, states: Sequence[str]) -> tuple[ca.SX, ca.SX]:
    """Symbols of the chosen states, and all states with those in them."""
    places = {v.name: i for i, v in enumerate(system.states)}
    x, at = ca.SX.sym("x", len(states)), ca.SX([v.start or 0.0 for v in system.states])
    for k, name in enumerate(states):
        at[_found(places, name, system.name)] = x[k]
    return x, at


def _prior(x: ca.SX, value: ca.SX) -> PriorMean:
    mean = ca.Function("mean", [x], [ca.densify(value)])
    slope = ca.Function("slope", [x], [ca.densify(ca.jacobian(value, x))])
    p, d = value.numel(), x.numel()

    def gradient(points: Array) -> Array:
        return np.array(slope.map(len(points))(points.T)).reshape(p, len(points), d).transpose(1, 0, 2)

    return PriorMean(lambda points: np.array(mean(points.T)).T, gradient)


def _found(names: dict[str, Any], name: str, model: str) -> Any:
    if name not in names:
        raise MisfitError(f"{model} has no {name!r}; {nearest(name, names)}")
    return names[name]
