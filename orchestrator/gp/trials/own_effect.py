"""Whether a learned function is a share of what the model itself lets its input do: a muscle that is weaker than the model says."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from orchestrator.gp.fit import Fit
from orchestrator.gp.posterior import condition
from orchestrator.gp.trials.functions import Verdict
from orchestrator.models.correction import PREFIX
from orchestrator.models.symbolic import SymbolicModel

Array = NDArray[np.float64]
# Corrections must reproduce what an input does to the rates up to this share.
_SAME = 1e-6
# A share that explains less of a function's mean square says nothing about it.
EXPLAINS = 0.8


@dataclass(frozen=True)
class Share:
    """A learned function is about `share` times what one unit of the input `factor` adds to `output` in the model (-0.3: 30 % less),
    which explains `explained` of its mean square."""

    output: str
    factor: str
    share: float
    explained: float


def shares(
    model: SymbolicModel, found: Fit, needed: Sequence[Verdict], states: Array, inputs: Array
) -> tuple[Share, ...]:
    """Of the needed functions of an output that an input multiplies, those that are a share of its own effect.

    Args:
        states: (n, nx) of the model, at the data of the fit.
        inputs: (n, nu) there.
    """
    posterior, (seen,) = condition(found.latents, found.observations), found.observations
    said = []
    for verdict in needed:
        own = _own_effect(model, verdict.factor, verdict.output, states, inputs) if verdict.factor else None
        if own is None or not np.any(own):
            continue
        # Only where the input acts is the function seen.
        weight = seen.coefficients[verdict.function] ** 2
        learned = posterior.mean(verdict.function, seen.inputs)[:, 0]
        share = float(np.sum(weight * learned * own) / np.sum(weight * own**2))
        left = float(np.sum(weight * (learned - share * own) ** 2) / np.sum(weight * learned**2))
        if 1.0 - left >= EXPLAINS:
            said.append(Share(verdict.output, verdict.factor, share, 1.0 - left))
    return tuple(said)


def _own_effect(model: SymbolicModel, factor: str, output: str, states: Array, inputs: Array) -> Array | None:
    """What one unit of an input adds to an output's force, (n,), by the slopes of the model's rates; None if no force does the same."""
    names = [v.name for v in model.system.inputs]
    forces = [name for name in names if name.startswith(PREFIX)]
    if PREFIX + output not in forces or factor not in names:
        return None
    slopes = _slopes(model, [names.index(factor), *map(names.index, forces)], states, inputs)
    found = np.zeros(len(states))
    for k, slope in enumerate(slopes):
        force, *_ = np.linalg.lstsq(slope[:, 1:], slope[:, 0], rcond=None)
        if np.linalg.norm(slope[:, 1:] @ force - slope[:, 0]) > _SAME * np.linalg.norm(slope[:, 0]):
            return None
        found[k] = force[forces.index(PREFIX + output)]
    return found


def _slopes(model: SymbolicModel, columns: Sequence[int], states: Array, inputs: Array) -> Array:
    """Derivatives of the rates by some inputs, (n, nx, columns)."""
    system = model.system
    x, u = ca.MX.sym("x", len(system.states)), ca.MX.sym("u", len(system.inputs))
    p = ca.DM([parameter.start or 0.0 for parameter in system.parameters])
    dx, _ = system.rhs(0, x, u, ca.DM.zeros(system.n_delays), p)
    slope = ca.Function("slope", [x, u], [ca.densify(ca.jacobian(dx, u)[:, list(columns)])])
    return np.array([np.array(slope(*at)) for at in zip(states, inputs, strict=True)])


def in_words(said: Sequence[Share]) -> Mapping[tuple[str, str], str]:
    """A phrase for each output and factor."""
    return {(each.output, each.factor): _phrase(each) for each in said}


def _phrase(each: Share) -> str:
    less = "less" if each.share < 0.0 else "more"
    size = f"{100.0 * abs(each.share):.3g} % {less} there than the model says"
    return f"as if {each.factor} acted {size} (explains {100 * each.explained:.0f} % of it)"
