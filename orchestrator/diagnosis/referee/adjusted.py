"""Parameters of a model that a fit moved within their stated tolerances: part of the patched model, never a discovery."""

import re
from collections.abc import Sequence

from fmus.errors import MisfitError
from fmus.symbolic.system import SymbolicSystem
from orchestrator.diagnosis.fit.evidence import Refit
from orchestrator.models.estimation import Z90
from orchestrator.verdicts.result import Adjusted, Estimate


def adjusted_parameters(found: Refit) -> tuple[Adjusted, ...]:
    """Parameters of the model that a fit moved within their tolerances, with 90 % intervals."""
    parameters = {v.name: v for v in found.model.system.parameters}
    rows = zip(
        found.model.compiled.free[found.size :],
        found.fit.values[found.size :],
        found.fit.std[found.size :],
        strict=True,
    )
    return tuple(
        Adjusted(
            name,
            float(parameters[name].start or 0.0),
            Estimate(float(value), parameters[name].unit, (float(value - Z90 * std), float(value + Z90 * std))),
        )
        for name, value, std in rows
    )


def with_neighbours(system: SymbolicSystem, adjusted: Sequence[Adjusted]) -> dict[str, float]:
    """Values by full name of all arrays that hold an adjusted parameter, as Modelica sets an array only as a whole.

    Raises:
        MisfitError: if the model has no such parameter.
    """
    values = {v.name: float(v.start or 0.0) for v in system.parameters}
    changed: set[str] = set()
    for entry in adjusted:
        if entry.name not in values:
            raise MisfitError(
                f"{entry.name} was adjusted within its tolerance, but {system.name} has no such parameter"
            )
        values[entry.name] = entry.fitted.value
        changed.add(_array(entry.name))
    return {name: value for name, value in values.items() if _array(name) in changed}


def _array(name: str) -> str:
    return re.sub(r"\[[\d,]+\]", "", name)
