"""Measurement sets: recorded trials on disk, and how their columns meet the variables of a model."""

from orchestrator.measurements.binding import bind
from orchestrator.measurements.bound import BoundSet, BoundTrial
from orchestrator.measurements.load import load_measurements
from orchestrator.measurements.noise import (
    declared_noise,
    estimated_noise,
    measurement_noise,
)
from orchestrator.measurements.pulses import excitation_from_pulses, is_pulse_train
from orchestrator.measurements.trial import MeasurementSet, Trial

__all__ = [
    "BoundSet",
    "BoundTrial",
    "MeasurementSet",
    "Trial",
    "bind",
    "declared_noise",
    "estimated_noise",
    "excitation_from_pulses",
    "is_pulse_train",
    "load_measurements",
    "measurement_noise",
]
