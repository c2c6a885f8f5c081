"""Studies: a system run with many values, seeds or FMUs, into one data set."""

from orchestrator.cosim.sweep.grid import Case, cases_of, parse_values
from orchestrator.cosim.sweep.study import Study, StudyOutcome

__all__ = ["Case", "Study", "StudyOutcome", "cases_of", "parse_values"]
