"""One FMU through the gate: `one.py FILE` prints JSON, a line of words for each thing that was tried."""

import json
import sys
import tempfile
from collections.abc import Callable, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from fmus.children import child_environment, python_command, run_child
from fmus.errors import MisfitError
from fmus.validate import examine_fmu
from orchestrator.cosim import ComponentSpec, System
from orchestrator.cosim.component import FLOATS, INTEGERS
from orchestrator.cosim.fmu import read_description
from orchestrator.cosim.run import RunOptions, run_system
from orchestrator.cosim.swap import swap
from orchestrator.cosim.system import RunSettings
from orchestrator.regress.case_file import read_cases
from orchestrator.regress.pool import run_cases
from orchestrator.regress.reference import expected_of_fmu
from orchestrator.regress.update import update_references
from orchestrator.results import MemoryRecorder, Result

MOST_STEPS = 500
NUMBERS = (*FLOATS, *INTEGERS, "Boolean", "Enumeration")
FMPY_S = 40.0


def main() -> None:
    """Try everything with the FMU that the command line names."""
    path = Path(sys.argv[1])
    found = _Found()
    found["validate"] = _told(lambda: _validated(path))
    try:
        description = read_description(path)
    except MisfitError as error:
        found["run"] = str(error)
        found["fmpy"] = _fmpy(path, None, {})[0]
        return
    found["tool"], found["version"] = description.tool, str(description.version)
    system = _system(path, description)
    made: dict[str, Result] = {}
    found["run"] = _told(lambda: _run(system, "here", made))
    found["fmpy"], theirs = _fmpy(path, system, {"interface": next(iter(description.interfaces), "")})
    if made and theirs is not None:
        found["difference"] = _difference(made["here"], theirs)
    if made:
        found["repeat"] = _told(lambda: _repeated(system, made))
        found["swap"] = _told(lambda: _swapped(system, path))
        found["regress"] = _told(lambda: _regressed(path, system))
        for name, difference in _reference(path, made["here"], theirs).items():
            found[name] = difference


class _Found(dict[str, Any]):
    """What was found, printed whenever something is added: an FMU can end this process at any time."""

    def __setitem__(self, name: str, value: Any) -> None:
        super().__setitem__(name, value)
        print(f"\n{json.dumps(self)}", flush=True)


def _told(work: Callable[[], str]) -> str:
    try:
        return work()
    except MisfitError as error:
        return str(error)
    except Exception as error:  # what should not be: it stands in the table as it is
        return f"INTERNAL {type(error).__name__}: {error}"


def _validated(path: Path) -> str:
    found = examine_fmu(path)
    return "; ".join([*found.findings[:1], *found.notes]) or "ok"


def _system(path: Path, description: Any) -> System:
    start, stop, step = description.start_time or 0.0, description.stop_time, description.step
    length = (stop - start) if stop is not None and stop > start else 1.0
    step = step or length / 100.0
    length = min(length, MOST_STEPS * step)
    run = RunSettings(start=start, stop=start + round(length / step) * step, step=step)
    return System("gate", {"fmu": ComponentSpec("fmu", source=path.name)}, run=run, folder=path.parent)


def _run(system: System, name: str, made: dict[str, Result]) -> str:
    recorder = MemoryRecorder()
    run_system(system, recorder, RunOptions(isolate=True))
    made[name] = recorder.result()
    return "ok"


def _repeated(system: System, made: dict[str, Result]) -> str:
    """The same run again, in this process, which the gate has set apart."""
    recorder = MemoryRecorder()
    run_system(system, recorder, RunOptions(isolate=False))
    again, here = recorder.result(), made["here"]
    same = all(np.array_equal(again[name], here[name], equal_nan=True) for name in here.names)
    return "ok" if same and np.array_equal(again.time, here.time) else "isolated and in process differ"


def _swapped(system: System, path: Path) -> str:
    found = swap(system, "fmu", path)
    return "ok" if found.system is not None else found.report.problems[0]


def _regressed(path: Path, system: System) -> str:
    with tempfile.TemporaryDirectory() as folder:
        run = f"start = {system.run.start!r}\nstop = {system.run.stop!r}\nstep = {system.run.step!r}\n"
        file = Path(folder) / "x.regress.toml"
        file.write_text(f'model = "{path}"\nreference = "x.csv"\n[run]\n{run}')
        if not any(port.causality == "output" and port.type in NUMBERS for port in read_description(path).ports):
            return "no outputs to compare"
        cases = read_cases(file)
        update_references(cases, run_cases(cases, 1, lambda _: None, "signals"))
        (outcome,) = run_cases(cases, 1, lambda _: None, "verdict")
        return "ok" if outcome.verdict == "passed" else outcome.reason


def _fmpy(path: Path, system: System | None, more: Mapping[str, Any]) -> tuple[str, dict[str, list[float]] | None]:
    settings = {**more, "path": str(path)}
    if system is not None:
        settings |= {"start": system.run.start, "stop": system.run.stop, "step": system.run.step}
    command = python_command("tests.benchmarks.fmus.with_fmpy:main", json.dumps(settings))
    try:
        done = run_child(command, environment=child_environment(), timeout_s=FMPY_S)
    except Exception:
        return f"no answer for {FMPY_S:g} s", None
    try:
        answer = json.loads(done.stdout.decode().splitlines()[-1])
    except (ValueError, IndexError):
        return f"crashed (exit code {done.returncode})", None
    return answer["words"], answer.get("columns")


def _difference(ours: Result, theirs: Mapping[str, list[float]], tolerance: float = 1e-6) -> float | None:
    """Largest difference at common times, as a share of the larger of a signal's range and size."""
    time = np.array(theirs["time"])
    at = np.clip(np.searchsorted(time, ours.time - tolerance), 0, len(time) - 1)
    common = np.abs(time[at] - ours.time) <= tolerance * max(1.0, float(np.max(np.abs(time))))
    worst = None
    for name in ours.names:
        column = theirs.get(name.partition(".")[2])
        if column is None or not common.any():
            continue
        one, other = np.asarray(ours[name], dtype=float)[common], np.array(column)[at][common]
        scale = max(float(np.max(np.abs(other), initial=0.0)), 1e-9)
        worst = max(worst or 0.0, float(np.max(np.abs(one - other), initial=0.0)) / scale)
    return worst


def _reference(path: Path, ours: Result, theirs: Mapping[str, list[float]] | None) -> dict[str, float | None]:
    """Differences of this run and of FMPy's to the reference results in or beside the FMU, where there are any."""
    try:
        signals = expected_of_fmu(path).signals
    except MisfitError:
        return {}
    if not signals:
        return {}
    columns = {name: each.values.tolist() for name, each in signals.items()}
    columns["time"] = next(iter(signals.values())).time.tolist()
    found = {"reference": _difference(ours, columns)}
    if theirs is not None:
        names = [name for name in ours.names if name.partition(".")[2] in theirs]
        time = np.array(theirs["time"])
        arrays = {name: np.array(theirs[name.partition(".")[2]]) for name in names}
        kept = tuple(column for column in ours.columns if column.name in names)
        found["fmpy_reference"] = _difference(replace(ours, time=time, columns=kept, arrays=arrays), columns)
    return found
