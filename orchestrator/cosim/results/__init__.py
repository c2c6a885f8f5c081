"""Results of runs: recording, reading back, comparing."""

from orchestrator.cosim.results.column import Column, chosen
from orchestrator.cosim.results.compare import ResultComparison, SignalDifference, compare_results
from orchestrator.cosim.results.reading import read_result
from orchestrator.cosim.results.recorder import MemoryRecorder, Nowhere, Recorder, recorder_for
from orchestrator.cosim.results.result import Result

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
