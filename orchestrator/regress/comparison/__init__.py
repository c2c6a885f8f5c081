"""Whether a result is the same as its reference: signals, tolerances, kinds of checks and verdicts, without files."""

from orchestrator.regress.comparison.bounds import Bounds
from orchestrator.regress.comparison.check import Check
from orchestrator.regress.comparison.conserved import Conserved
from orchestrator.regress.comparison.end_value import EndValue
from orchestrator.regress.comparison.events import Events
from orchestrator.regress.comparison.expression import combine
from orchestrator.regress.comparison.funnel import Funnel
from orchestrator.regress.comparison.judge_all import judge_all
from orchestrator.regress.comparison.pointwise import Pointwise
from orchestrator.regress.comparison.result import SignalVerdict
from orchestrator.regress.comparison.signal import Interpolation, Signal
from orchestrator.regress.comparison.statistics import Statistics
from orchestrator.regress.comparison.steady_state import SteadyState
from orchestrator.regress.comparison.tolerance import Tolerance
from orchestrator.regress.comparison.tube import Tube, compare

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
    "compare",
    "judge_all",
]
