"""Results of runs: recording, reading back, comparing."""

from orchestrator.results.column import Column, chosen
from orchestrator.results.compare import ResultComparison, SignalDifference, compare_results
from orchestrator.results.recorder import MemoryRecorder, Nowhere, Recorder, recorder_for
from orchestrator.results.result import Result, read_result

__all__ = [
    "Column",
    "MemoryRecorder",
    "Nowhere",
    "Recorder",
    "Result",
    "ResultComparison",
    "SignalDifference",
    "chosen",
    "compare_results",
    "read_result",
    "recorder_for",
]
