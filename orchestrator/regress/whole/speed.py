"""CPU time and memory of a run against those of another FMU, as ratios measured in turn."""

import json
import pickle
import sys
from collections.abc import Mapping
from statistics import median
from typing import Any

from fmus.children import child_environment, python_command, run_child
from fmus.errors import ComponentError
from orchestrator.cosim.system import System
from orchestrator.regress.case import Case
from orchestrator.regress.outcome import WholeVerdict
from orchestrator.regress.prepare import system_of
from orchestrator.regress.recording import record, wanted_signals
from orchestrator.regress.watched import Watched

# One measurement takes at least this long, so that the clock's grain does not matter.
_AT_LEAST_S = 0.02
# Memory below this is that of the allocator, not of the FMU.
_GRAIN = 2.0**20


def judge(case: Case, system: System, settings: Mapping[str, Any], progress: Watched) -> WholeVerdict:
    """Run old and new in turn in this process for the time, and each in a process of its own for the memory."""
    old = system_of(case, settings["fmu"])
    times: tuple[list[float], list[float]] = ([], [])
    repeats = max(1, round(_AT_LEAST_S / max(_seconds(old, 1, progress), 1e-6)))
    _seconds(system, 1, progress)
    for _ in range(settings["runs"]):
        for each, found in zip((old, system), times, strict=True):
            found.append(_seconds(each, repeats, progress))
    # The ratio of neighbours, since what else the machine does changes slowly.
    ratio = median(new / before for before, new in zip(*times, strict=True))
    progress.leave()
    grown = [_memory(each) for each in (old, system)]
    memory = (grown[1] + _GRAIN) / (grown[0] + _GRAIN)
    figures = {"time_ratio": ratio, "memory_ratio": memory, "cpu_seconds": [median(t) / repeats for t in times]}
    figures["memory_bytes"] = grown
    words = f"{ratio:.3g} times the CPU time and {memory:.3g} times the memory of {settings['fmu']}"
    slow, large = ratio > settings["at_most"], memory > settings["memory_at_most"]
    if slow or large:
        limits = [f"{settings['at_most']:g} times the time"] * slow + [
            f"{settings['memory_at_most']:g} times the memory"
        ] * large
        words += f"; at most {' and '.join(limits)} is allowed"
    return WholeVerdict("speed", not (slow or large), words, figures)


def _seconds(system: System, repeats: int, progress: Watched) -> float:
    wanted, _ = wanted_signals(system)
    return sum(record(system, wanted, progress).seconds for _ in range(repeats))


def _memory(system: System) -> float:
    """Bytes by which a run raises the peak of its process."""
    command = python_command(f"{__name__}:grown")
    done = run_child(command, environment=child_environment(), given=pickle.dumps(system))
    if done.returncode != 0:
        last = (done.stderr.decode(errors="replace").strip().splitlines() or ["no message"])[-1]
        raise ComponentError(f"the run for its memory failed: {last}")
    return float(json.loads(done.stdout.splitlines()[-1]))


def grown() -> None:
    """Run the system on standard input, and print by how many bytes the peak of memory rose."""
    import resource

    system: System = pickle.load(sys.stdin.buffer)
    wanted, _ = wanted_signals(system)
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    record(system, wanted)
    print(json.dumps(1024 * (resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before)))
