"""Coupled systems of FMUs and other components: described, checked, run, recorded."""

from orchestrator.cosim.component import Component, Port, StepEnd
from orchestrator.cosim.system import ComponentSpec, Connection, RunSettings, System, Value

__all__ = ["Component", "ComponentSpec", "Connection", "Port", "RunSettings", "StepEnd", "System", "Value"]
