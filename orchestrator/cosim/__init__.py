"""Coupled systems of FMUs and other components: described, checked, run, recorded."""

from importlib import import_module
from typing import TYPE_CHECKING, Any

from orchestrator.cosim.component import Component, Port, StepEnd
from orchestrator.cosim.system import ComponentSpec, Connection, RunSettings, System, Value

if TYPE_CHECKING:
    from orchestrator.cosim.load import load_system
    from orchestrator.cosim.run import simulate
    from orchestrator.cosim.simulation import Simulation

# What runs a system is imported when it is used; a description alone needs none of it.
_HOMES = {"Simulation": "simulation", "load_system": "load", "simulate": "run"}

__all__ = [
    "Component",
    "ComponentSpec",
    "Connection",
    "Port",
    "RunSettings",
    "Simulation",
    "StepEnd",
    "System",
    "Value",
    "load_system",
    "simulate",
]


def __getattr__(name: str) -> Any:
    if name not in _HOMES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    found = getattr(import_module(f"{__name__}.{_HOMES[name]}"), name)
    globals()[name] = found
    return found
