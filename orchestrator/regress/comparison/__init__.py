"""Whether a result is the same as its reference: signals, tolerances, kinds of checks and verdicts, without files."""

from orchestrator.regress.comparison.check import Check
from orchestrator.regress.comparison.result import SignalVerdict
from orchestrator.regress.comparison.signal import Interpolation, Signal
from orchestrator.regress.comparison.tolerance import Tolerance
from orchestrator.regress.comparison.tube import Tube, compare

__all__ = ["Check", "Interpolation", "Signal", "SignalVerdict", "Tolerance", "Tube", "compare"]
