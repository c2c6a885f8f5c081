"""What a physics model expects of learned functions, as their prior means."""

import hashlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from fmus.catalogue import find_modelica_model
from fmus.errors import MisfitError
from fmus.symbolic.system import SymbolicSystem
from orchestrator.gp.covariance import Latent
from orchestrator.measurements.wording import nearest

Array = NDArray[Any]


@dataclass(frozen=True)
class Origin:
    """Where a prior mean comes from, so that a file can name it: `model` is a built-in name or FILE.mo:Class.

    It is what the model says of `values` at `states`: at rest of all factors (`factor` ""), or what a factor adds at 1.
    `version` is the SHA-256 of the formula with the numbers of the model in it, "" in files of before.
    """

    model: str
    values: tuple[str, ...]
    states: tuple[str, ...]
    factor: str = ""
    version: str = ""


@dataclass(frozen=True, eq=False)
class PriorMean:
    """A prior mean with its exact gradient: `formula` maps a point (d, 1) to (p, 1); `origin` is None where nobody named the model."""

    formula: ca.Function
    slope: ca.Function
    origin: Origin | None = None

    @property
    def version(self) -> str:
        """SHA-256 of the formula, in hex: equal ones expect the same."""
        return hashlib.sha256(self.formula.serialize().encode()).hexdigest()

    def mean(self, points: Array) -> Array:
        """Expected values at points (n, d), (n, p)."""
        return np.array(self.formula(points.T)).T

    def gradient(self, points: Array) -> Array:
        """Their derivatives by the points, (n, p, d)."""
        p, d = self.formula.size1_out(0), self.formula.size1_in(0)
        return np.array(self.slope.map(len(points))(points.T)).reshape(p, len(points), d).transpose(1, 0, 2)


def physics_of(latent: Latent) -> PriorMean | None:
    """The physics model that is a latent function's prior mean, if its mean is one's method."""
    owner = getattr(latent.mean, "__self__", None)
    return owner if isinstance(owner, PriorMean) else None


def prior_means_of(
    model: str, values: Sequence[str], states: Sequence[str], factors: Sequence[str]
) -> tuple[PriorMean, tuple[PriorMean, ...]]:
    """`prior_means` of a built-in model or FILE.mo:Class, which blocks can be saved with: their files name the model.

    Args:
        model: name of a built-in model, or FILE.mo:Class.
        values: variables of the model, (p,).
        states: (d,) states that the functions depend on.
        factors: inputs of the model.

    Returns:
        The mean where all factors are 0, and what each factor adds at 1.

    Raises:
        MisfitError: as `prior_means`, or if there is no such model.
    """
    rest, parts = prior_means(find_modelica_model(model).compile(), values, states, factors)
    origin = Origin(model, tuple(values), tuple(states))
    named = tuple(
        replace(part, origin=replace(origin, factor=factor, version=part.version))
        for part, factor in zip(parts, factors, strict=True)
    )
    return replace(rest, origin=replace(origin, version=rest.version)), named


def prior_from(given: Mapping[str, Any]) -> PriorMean:
    """The prior mean that a file names.

    Raises:
        MisfitError: if there is no such model, or it lacks a name.
    """
    origin = Origin(str(given["model"]), tuple(given["values"]), tuple(given["states"]), str(given["factor"]))
    factors = [origin.factor] if origin.factor else []
    rest, parts = prior_means_of(origin.model, origin.values, origin.states, factors)
    return parts[0] if parts else rest


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
    return PriorMean(mean, ca.Function("slope", [x], [ca.densify(ca.jacobian(value, x))]))


def _found(names: dict[str, Any], name: str, model: str) -> Any:
    if name not in names:
        raise MisfitError(f"{model} has no {name!r}; {nearest(name, names)}")
    return names[name]
