"""misfit: a physics model and a measurement disagree; name the missing effect, add it, and watch the error fall.

This module is the public list. What is not named here is private to its package and may change.

Example:
    >>> import misfit                                          # doctest: +SKIP
    >>> data = misfit.Data.read("tests/cases/pendulum")        # doctest: +SKIP
    >>> model = misfit.Model("pendulum")                       # doctest: +SKIP
    >>> better = model.add(model.diagnose(data).effects)       # doctest: +SKIP
    >>> better.compare(data).plot()                            # doctest: +SKIP
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

from misfit_start import import_our_packages

if TYPE_CHECKING:
    from fmus.errors import ComponentError, MisfitError
    from hil.python import Bench, BenchSession
    from orchestrator.api.block import Block
    from orchestrator.api.calls import compare, diagnose, effects, models
    from orchestrator.api.data import Data
    from orchestrator.api.missing import Missing
    from orchestrator.api.model import Model
    from orchestrator.api.regression import Regression, regress
    from orchestrator.api.system import System
    from orchestrator.compare.result import Comparison
    from orchestrator.cosim.component import Component, Port, StepEnd
    from orchestrator.cosim.simulation import Simulation
    from orchestrator.results.result import Result
    from orchestrator.verdicts.result import Diagnosis, Estimate, NamedEffect

# Where each name lives. It is imported when it is used, so that `import misfit` takes a moment and not seconds.
_HOMES = {
    "Bench": "hil.python",
    "BenchSession": "hil.python",
    "Block": "orchestrator.api.block",
    "Comparison": "orchestrator.compare.result",
    "Component": "orchestrator.cosim.component",
    "ComponentError": "fmus.errors",
    "Data": "orchestrator.api.data",
    "Diagnosis": "orchestrator.verdicts.result",
    "Estimate": "orchestrator.verdicts.result",
    "Missing": "orchestrator.api.missing",
    "MisfitError": "fmus.errors",
    "Model": "orchestrator.api.model",
    "NamedEffect": "orchestrator.verdicts.result",
    "Port": "orchestrator.cosim.component",
    "Regression": "orchestrator.api.regression",
    "Result": "orchestrator.results.result",
    "Simulation": "orchestrator.cosim.simulation",
    "StepEnd": "orchestrator.cosim.component",
    "System": "orchestrator.api.system",
    "compare": "orchestrator.api.calls",
    "diagnose": "orchestrator.api.calls",
    "effects": "orchestrator.api.calls",
    "models": "orchestrator.api.calls",
    "regress": "orchestrator.api.regression",
}

__all__ = [
    "Bench",
    "BenchSession",
    "Block",
    "Comparison",
    "Component",
    "ComponentError",
    "Data",
    "Diagnosis",
    "Estimate",
    "Missing",
    "MisfitError",
    "Model",
    "NamedEffect",
    "Port",
    "Regression",
    "Result",
    "Simulation",
    "StepEnd",
    "System",
    "compare",
    "diagnose",
    "effects",
    "models",
    "regress",
]


def __getattr__(name: str) -> Any:
    if name not in _HOMES:
        raise AttributeError(f"misfit has no {name!r}; it has {', '.join(__all__)}")
    import_our_packages()
    found = getattr(import_module(_HOMES[name]), name)
    globals()[name] = found
    return found


def __dir__() -> list[str]:
    return list(__all__)
