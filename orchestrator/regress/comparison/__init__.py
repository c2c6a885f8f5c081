"""Whether a result is the same as its reference: signals, tolerances, kinds of checks and verdicts, without files."""

from orchestrator.regress.comparison.bounds import Bounds, Conserved
from orchestrator.regress.comparison.events import Events
from orchestrator.regress.comparison.expression import combine
from orchestrator.regress.comparison.one_number import EndValue, Statistics, SteadyState
from orchestrator.regress.comparison.signal import Check, Interpolation, Signal, SignalVerdict, Tolerance
from orchestrator.regress.comparison.tube import Funnel, Pointwise, Tube, compare_signals

__all__ = [
    "Bounds",
    "Check",
    "Conserved",
    "EndValue",
    "Events",
    "Funnel",
    "Interpolation",
    "Pointwise",
    "Signal",
    "SignalVerdict",
    "Statistics",
    "SteadyState",
    "Tolerance",
    "Tube",
    "combine",
    "compare_signals",
]
