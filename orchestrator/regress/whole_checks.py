"""Checks of a whole model beside its trajectories; see `case_file` for their settings."""

import json
import math
import pickle
import sys
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from functools import partial
from statistics import median
from typing import Any

import numpy as np

from fmus.children import child_environment, python_command, run_child
from fmus.errors import ComponentError
from fmus.units import after_number
from fmus.validate import validate_fmu
from orchestrator.cosim.isolate.process import ChildLimits
from orchestrator.cosim.isolate.simulation import IsolatedSimulation
from orchestrator.cosim.simulation import Simulation
from orchestrator.cosim.system import System
from orchestrator.regress import release
from orchestrator.regress.case import Case
from orchestrator.regress.comparison import Signal
from orchestrator.regress.outcome import WholeVerdict
from orchestrator.regress.prepare import system_of
from orchestrator.regress.recording import Recording, Wanted, Watched, record, wanted_signals
from orchestrator.results.recorder import MemoryRecorder


def difference(one: Mapping[str, Signal], other: Mapping[str, Signal], within: float = 0.0) -> str:
    """What differs first, in words; "" if nothing does.

    Args:
        within: share of a signal's range that two values may be apart; 0 asks for the same bits.
    """
    for name, signal in one.items():
        there = other[name]
        count = min(len(signal.time), len(there.time))
        if len(signal.time) != len(there.time):
            return f"{name} has {len(signal.time)} rows once and {len(there.time)} the other time"
        same = _same(signal.values[:count], there.values[:count], within)
        same &= signal.time[:count] == there.time[:count]
        if not same.all():
            row = int(np.argmin(same))
            apart = (
                float(np.nanmax(np.abs(signal.values - there.values))) if np.isfinite(signal.values).any() else np.nan
            )
            unit = after_number(signal.unit)
            return (
                f"{name} parts at {signal.time[row]:.9g} s: {signal.values[row]!r} and {there.values[row]!r}{unit}; "
                f"at most {apart:.3g}{unit} apart"
            )
    return ""


def _same(one: np.ndarray, other: np.ndarray, within: float) -> np.ndarray:
    if within == 0.0:
        return np.asarray(one.view(np.uint64) == other.view(np.uint64))
    finite = one[np.isfinite(one)]
    limit = within * (float(np.ptp(finite)) if finite.size else 0.0)
    return np.asarray((np.abs(one - other) <= limit) | (np.isnan(one) & np.isnan(other)))


def conformance(case: Case, system: System, settings: Mapping[str, Any], progress: Watched) -> WholeVerdict:
    """Validate each FMU; findings that have one of the accepted texts in them do not count.

    Args:
        case: the case.
        system: what it runs.
        settings: `accept`, texts of findings.
        progress: where it is noted what runs.
    """
    progress.leave()
    paths = [system.folder / spec.source for spec in system.components.values() if spec.kind == "fmu"]
    found = [(path, finding) for path in dict.fromkeys(paths) for finding in validate_fmu(path)]
    accepted = [finding for _, finding in found if any(text in finding for text in settings["accept"])]
    left = [f"{path.name}: {finding}" for path, finding in found if finding not in accepted]
    more = f" (and {len(left) - 1} more)" if len(left) > 1 else ""
    if left:
        return WholeVerdict("conformance", False, f"{left[0]}{more}", {"findings": left, "accepted": accepted})
    words = f"no findings in {len(set(paths))} FMU" + ("s" if len(set(paths)) > 1 else "")
    words += f", {len(accepted)} accepted" if accepted else ""
    return WholeVerdict("conformance", True, words, {"findings": [], "accepted": accepted})


def determinism(case: Case, system: System, settings: Mapping[str, Any], progress: Watched) -> WholeVerdict:
    """Run the case five times; all outputs count.

    Args:
        case: the case, for the limits of its child processes.
        system: what it runs.
        settings: none.
        progress: where it is noted what runs.
    """
    wanted, _ = wanted_signals(system)
    first = record(system, wanted, progress)
    limits = ChildLimits(case.limits.patience_s, case.limits.memory_gib)
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


def _isolated(system: System, wanted: Wanted, limits: ChildLimits, progress: Watched) -> Recording:
    progress.leave()  # from here on another process calls the components
    return record(system, wanted, open_=partial(IsolatedSimulation, limits=limits))


def save_restore(case: Case, system: System, settings: Mapping[str, Any], progress: Watched) -> WholeVerdict:
    """Run to a share of the way, save, go on to the end, restore, go on again: both ways to the end are the same.

    Args:
        case: the case.
        system: what it runs.
        settings: `at`, the share of the way, and `within`, by how much both ways may differ.
        progress: where it is noted what runs.
    """
    wanted, _ = wanted_signals(system)
    start, stop, step = system.run.start or 0.0, system.run.stop, system.run.step
    assert stop is not None and step is not None
    middle = start + step * max(1, round(settings["at"] * (stop - start) / step))
    progress.begin(system)
    with Simulation(system, record=wanted.recorded or None, progress=progress) as simulation:
        unable = [name for name, each in simulation.coupling.components.items() if not each.can_save]
        if unable:
            return WholeVerdict("save_restore", False, f"{', '.join(unable)} cannot save the state")
        simulation.run(middle)
        point = simulation.save()
        ways = [_onward(simulation, wanted, stop)]
        # Twice, since a state has to survive being restored.
        for _ in range(2):
            try:
                simulation.restore(point)
            except ComponentError as error:
                return WholeVerdict("save_restore", False, f"the state of {middle:.9g} s cannot be restored: {error}")
            ways.append(_onward(simulation, wanted, stop))
    for number, way in enumerate(ways[1:], 1):
        found = difference(ways[0], way, settings["within"])
        if found:
            words = f"after the state of {middle:.9g} s was restored ({number}x) the run differs: {found}"
            return WholeVerdict("save_restore", False, words)
    return WholeVerdict("save_restore", True, f"the state of {middle:.9g} s was restored twice, with the same end")


def _onward(simulation: Simulation, wanted: Wanted, stop: float) -> dict[str, Signal]:
    memory = MemoryRecorder()
    simulation.run(stop, memory)
    memory.finish()
    result = memory.result()
    return {
        name: Signal(name, result.time, result[address], result.column(address).unit)
        for name, address in wanted.addresses.items()
        if name not in wanted.inside
    }


# Differences below this share of the range are those of the FMU's own solver.
_ROUNDING = 1e-7


def convergence(case: Case, system: System, settings: Mapping[str, Any], progress: Watched) -> WholeVerdict:
    """Halve the step so many times; the last halving may change no output by more than a share of its range.

    The order is log2 of the ratio of two successive changes, nan where they are as small as the FMU's own errors.

    Args:
        case: the case.
        system: what it runs.
        settings: `halvings`, and `within`, the share that is allowed.
        progress: where it is noted what runs.
    """
    step, halvings = system.run.step, max(2, settings["halvings"])
    assert step is not None
    wanted, _ = wanted_signals(system)
    runs = []
    for k in range(halvings + 1):
        finer = system_of(replace(case, step=step / 2**k))
        runs.append(record(finer, wanted, progress).signals)
    figures: dict[str, Any] = {}
    worst = ("", 0.0, math.nan)
    for name in wanted.addresses:
        changes = [_change(runs[k][name], runs[k + 1][name], 2**k) for k in range(halvings)]
        figures[name] = {"changes": changes, "order": _order(changes)}
        grows = changes[-1] > 1.5 * changes[0] + _ROUNDING
        if grows or changes[-1] > worst[1] or not math.isfinite(changes[-1]):
            worst = (name, math.inf if grows or not math.isfinite(changes[-1]) else changes[-1], _order(changes))
        if grows:
            words = f"{name} changes by {_shares(changes)} of its range as the step is halved from {step:g} s: it does not settle"
            return WholeVerdict("convergence", False, words, figures)
    name, change, order = worst
    smallest = step / 2**halvings
    words = f"the last halving, to {smallest:g} s, changes {name or 'nothing'} most: by {change:.3g} of its range"
    words += f" (order {order:.2g})" if math.isfinite(order) else ""
    if change > settings["within"]:
        return WholeVerdict("convergence", False, f"{words}; at most {settings['within']:g} is allowed", figures)
    return WholeVerdict("convergence", True, words, figures)


def _change(coarse: Signal, fine: Signal, stride: int) -> float:
    """Largest difference at the points of the coarsest run, as a share of the range."""
    one, other = coarse.values[::stride], fine.values[:: 2 * stride]
    count = min(len(one), len(other))
    size = float(np.ptp(other)) or float(np.abs(other).max(initial=0.0)) or 1.0
    return float(np.abs(one[:count] - other[:count]).max(initial=0.0)) / size


def _order(changes: Sequence[float]) -> float:
    if not (changes[-1] > _ROUNDING and changes[-2] > 0.0):
        return math.nan
    return math.log2(changes[-2] / changes[-1])


def _shares(changes: Sequence[float]) -> str:
    return ", ".join(f"{change:.2g}" for change in changes)


# One measurement takes at least this long, so that the clock's grain does not matter.
_AT_LEAST_S = 0.02
# Memory below this is that of the allocator, not of the FMU.
_GRAIN = 2.0**20


def speed(case: Case, system: System, settings: Mapping[str, Any], progress: Watched) -> WholeVerdict:
    """Run old and new in turn in this process for the time, and each in a process of its own for the memory.

    Args:
        case: the case.
        system: the new one.
        settings: `fmu`, the old one, `runs`, and `at_most` and `memory_at_most`, ratios that are allowed.
        progress: where it is noted what runs.
    """
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


def judge_whole(name: str, case: Case, system: System, settings: Mapping[str, Any], progress: Watched) -> WholeVerdict:
    """The verdict of a check on the system of a case.

    Args:
        name: name of the check.
        case: the case.
        system: what it runs.
        settings: those of the check.
        progress: where it is noted what runs.

    Raises:
        MisfitError: if it cannot be carried out.
        ComponentError: if a component fails on the way.
    """
    return _JUDGES[name](case, system, settings, progress)


_JUDGES: Mapping[str, Callable[[Case, System, Mapping[str, Any], Watched], WholeVerdict]] = {
    "conformance": conformance,
    "determinism": determinism,
    "save_restore": save_restore,
    "convergence": convergence,
    "release": release.judge,
    "speed": speed,
}
