"""Hyperparameters that make the observations most probable, found by IPOPT through CasADi with exact gradients."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import casadi
import numpy as np
from numpy.typing import NDArray
from threadpoolctl import threadpool_limits

from fmus.errors import MisfitError
from orchestrator.gp.covariance import Latents
from orchestrator.gp.likelihood import Likelihood
from orchestrator.gp.limits import Box, Limits, Units, box
from orchestrator.gp.observations import Observation

Array = NDArray[Any]
# The objective has a rounding floor: IPOPT asked for less than this slope searches there for thousands of evaluations,
# while the optimum is already within 1e-7 (the error goes with the square of the slope).
_SLOPE = 1e-3
_MOST_ITERATIONS = 200
_AT_BOUND = 1e-3


@dataclass(frozen=True, eq=False)
class Fit:
    """Latent functions and observations with the best hyperparameters found, and how they were found.

    `value` is the negative log marginal likelihood, without priors. `values` are those of all starts, `evaluations` how often
    each computed it. `at_bounds` names parameters at a bound that came from the data or the user; `held` those about which
    the data say nothing.
    """

    latents: Latents
    observations: tuple[Observation, ...]
    parameters: Mapping[str, float]
    value: float
    values: tuple[float, ...]
    evaluations: tuple[int, ...]
    at_bounds: tuple[str, ...]
    held: tuple[str, ...]


def fit(
    latents: Latents,
    observations: Sequence[Observation],
    limits: Mapping[str, Limits] | None = None,
    units: Units | None = None,
    starts: int = 3,
    seed: int = 0,
) -> Fit:
    """Fit kernels and learnt noise to all observations together, from the values given and from `starts` - 1 others.

    BLAS runs in one thread meanwhile: with two, factorisations of this size take up to 100 times as long.

    Args:
        limits: bounds and priors by name of a parameter, such as `strong.length_scales[3]`.
        units: units of the data, for limits that have one.
        seed: of the other starts, which lie within a factor of 10 of the first.

    Raises:
        MisfitError: if a limit is wrong, or no start leads anywhere.
    """
    likelihood = Likelihood(latents, observations)
    limit = box(likelihood, observations, limits or {}, units or Units())
    rng = np.random.default_rng(seed)
    others = [rng.uniform(-1.0, 1.0, len(likelihood.start)) * np.log(10.0) for _ in range(starts - 1)]
    runs = []
    with threadpool_limits(1, "blas"):
        for move in (0.0, *others):
            begin = np.clip(likelihood.start + move, limit.low, limit.high)
            runs.append(_run(_Objective(likelihood, limit), begin, limit))
    best = min(runs, key=lambda run: run[1])
    if not np.isfinite(best[1]):
        raise MisfitError(
            f"no start of {starts} gave a likelihood; give observations more noise, or narrower limits to the hyperparameters"
        )
    found = best[0]
    fitted = likelihood.at(found)
    width = limit.high - limit.low
    near = (found - limit.low < _AT_BOUND) | (limit.high - found < _AT_BOUND)
    physical = np.where(likelihood.logarithmic, np.exp(found), found)
    return Fit(
        latents=fitted[0],
        observations=fitted[1],
        parameters=dict(zip(likelihood.names, map(float, physical), strict=True)),
        value=likelihood(found)[0],
        values=tuple(float(value) for _, value, _ in runs),
        evaluations=tuple(count for *_, count in runs),
        at_bounds=tuple(name for name, at in zip(likelihood.names, near & (width > 0.0), strict=True) if at),
        held=limit.held,
    )


def _run(objective: "_Objective", begin: Array, limit: Box) -> tuple[Array, float, int]:
    """Where IPOPT ends, the objective there (inf where it cannot be computed) and the number of evaluations."""
    if not np.any(limit.high > limit.low):  # all is given: nothing to search
        value = objective.at(begin)[0]
        return begin, value if np.isfinite(value) else np.inf, objective.evaluations
    x = casadi.MX.sym("x", len(begin))
    options: Any = {
        "print_time": False,
        "show_eval_warnings": False,
        "ipopt.print_level": 0,
        "ipopt.sb": "yes",
        "ipopt.tol": _SLOPE,
        "ipopt.max_iter": _MOST_ITERATIONS,
        "ipopt.hessian_approximation": "limited-memory",
        "ipopt.nlp_scaling_method": "none",
        "ipopt.bound_relax_factor": 0.0,
    }
    problem: Any = {"x": x, "f": objective(x)}
    solver = casadi.nlpsol("fit", "ipopt", problem, options)
    found = np.clip(np.array(solver(x0=begin, lbx=limit.low, ubx=limit.high)["x"]).ravel(), limit.low, limit.high)
    value = objective.at(found)[0]
    return found, value if np.isfinite(value) else np.inf, objective.evaluations


class _Objective(casadi.Callback):
    """Likelihood and prior as a function of CasADi, with the exact gradient as its Jacobian."""

    def __init__(self, likelihood: Likelihood, limit: Box) -> None:
        casadi.Callback.__init__(self)
        self._likelihood, self._limit = likelihood, limit
        self._last: tuple[bytes, float, Array] = (b"", 0.0, np.zeros(0))
        self._slope: _Slope | None = None
        self.evaluations = 0
        self.construct("likelihood", {})

    def at(self, parameters: Array) -> tuple[float, Array]:
        """Value and gradient; NaN where the covariance has no factor, from which IPOPT steps back."""
        key = parameters.tobytes()
        if key != self._last[0]:
            self.evaluations += 1
            try:
                value, slope = self._likelihood(parameters)
                prior, prior_slope = self._limit.prior(parameters)
                self._last = (key, value + prior, slope + prior_slope)
            except MisfitError:
                self._last = (key, np.nan, np.full(len(parameters), np.nan))
        return self._last[1], self._last[2]

    def get_n_in(self) -> int:
        return 1

    def get_n_out(self) -> int:
        return 1

    def get_sparsity_in(self, place: int) -> Any:
        return casadi.Sparsity.dense(len(self._likelihood.start), 1)

    def get_sparsity_out(self, place: int) -> Any:
        return casadi.Sparsity.dense(1, 1)

    def eval(self, arguments: Sequence[Any]) -> list[float]:
        return [self.at(np.array(arguments[0]).ravel())[0]]

    def has_jacobian(self) -> bool:
        return True

    def get_jacobian(self, name: str, names_in: Any, names_out: Any, options: Any) -> Any:
        self._slope = _Slope(self, name, len(self._likelihood.start))
        return self._slope


class _Slope(casadi.Callback):
    """The gradient of an objective, from parameters and the value there, as CasADi asks for Jacobians."""

    def __init__(self, objective: _Objective, name: str, count: int) -> None:
        casadi.Callback.__init__(self)
        self._objective, self._count = objective, count
        self.construct(name, {})

    def get_n_in(self) -> int:
        return 2

    def get_n_out(self) -> int:
        return 1

    def get_sparsity_in(self, place: int) -> Any:
        return casadi.Sparsity.dense(1 if place else self._count, 1)

    def get_sparsity_out(self, place: int) -> Any:
        return casadi.Sparsity.dense(1, self._count)

    def eval(self, arguments: Sequence[Any]) -> list[Any]:
        return [self._objective.at(np.array(arguments[0]).ravel())[1][None, :]]
