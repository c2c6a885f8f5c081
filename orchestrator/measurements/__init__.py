"""Measurement sets: recorded trials on disk, and how their columns meet the variables of a model."""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from orchestrator.measurements.binding import bind
    from orchestrator.measurements.bound import BoundSet, BoundTrial
    from orchestrator.measurements.colour import Noise
    from orchestrator.measurements.load import load_measurements
    from orchestrator.measurements.noise import declared_noise, estimated_noise, measurement_noise
    from orchestrator.measurements.pulses import excitation_from_pulses, is_pulse_train
    from orchestrator.measurements.trial import MeasurementSet, Trial

# Some of it needs SciPy, which takes a second to import; whoever only reads a table or writes a message should not wait.
_HOMES = {
    "BoundSet": "bound",
    "BoundTrial": "bound",
    "MeasurementSet": "trial",
    "Noise": "colour",
    "Trial": "trial",
    "bind": "binding",
    "declared_noise": "noise",
    "estimated_noise": "noise",
    "excitation_from_pulses": "pulses",
    "is_pulse_train": "pulses",
    "load_measurements": "load",
    "measurement_noise": "noise",
}

__all__ = [
    "BoundSet",
    "BoundTrial",
    "MeasurementSet",
    "Noise",
    "Trial",
    "bind",
    "declared_noise",
    "estimated_noise",
    "excitation_from_pulses",
    "is_pulse_train",
    "load_measurements",
    "measurement_noise",
]


def __getattr__(name: str) -> Any:
    if name not in _HOMES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(f"{__name__}.{_HOMES[name]}"), name)
