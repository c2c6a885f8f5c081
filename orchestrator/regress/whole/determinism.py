"""The same case gives the same bits: twice in one process, without the loop in C, and isolated in either way."""

from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import partial
from typing import Any

from orchestrator.cosim.isolate.process import Limits
from orchestrator.cosim.isolate.simulation import IsolatedSimulation
from orchestrator.cosim.system import System
from orchestrator.regress.case import Case
from orchestrator.regress.outcome import WholeVerdict
from orchestrator.regress.recording import Recording, Wanted, record, wanted_signals
from orchestrator.regress.watched import Watched
from orchestrator.regress.whole.same import difference


def judge(case: Case, system: System, settings: Mapping[str, Any], progress: Watched) -> WholeVerdict:
    """Run the case five times; all outputs count."""
    wanted, _ = wanted_signals(system)
    first = record(system, wanted, progress)
    limits = Limits(case.limits.patience_s, case.limits.memory_gib)
    ways: dict[str, Callable[[], Recording]] = {
        "the second run in one process": lambda: record(system, wanted, progress),
        "a run without the loop in C": lambda: record(system, wanted, progress, engine=False),
        "a run in a process of its own": lambda: _isolated(system, wanted, limits, progress),
        "a run with each FMU in a process of its own": lambda: record(_apart(system), wanted, progress),
    }
    for words, run in ways.items():
        found = difference(first.signals, run().signals)
        if found:
            return WholeVerdict("determinism", False, f"{words} differs from the first: {found}")
    count = len(wanted.addresses)
    return WholeVerdict("determinism", True, f"the same bits of {count} outputs in {1 + len(ways)} runs")


def _apart(system: System) -> System:
    for spec in system.components.values():
        if spec.kind == "fmu":
            system = system.with_component(replace(spec, isolate=True))
    return system


def _isolated(system: System, wanted: Wanted, limits: Limits, progress: Watched) -> Recording:
    progress.leave()  # from here on another process calls the components
    return record(system, wanted, open_=partial(IsolatedSimulation, limits=limits))
