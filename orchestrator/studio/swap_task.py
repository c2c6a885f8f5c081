"""The job of the swap view: read both interfaces, run both FMUs, each in a process of its own, and compare what they do."""

import json
from collections.abc import Callable
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from fmus.errors import MisfitError
from fmus.files import write_atomically
from fmus.units import conversion
from orchestrator.cosim.compatible import unit_scaling
from orchestrator.cosim.component import FLOATS, Port
from orchestrator.cosim.fmu import FmuDescription, read_description
from orchestrator.cosim.run import RunOptions, RunOutcome, run_system
from orchestrator.cosim.swap import SwapReport
from orchestrator.regress.one_run import case_of
from orchestrator.regress.outcome import plain
from orchestrator.regress.prepare import DRIVE, system_of
from orchestrator.regress.release import interface_change, interface_report
from orchestrator.report.arm_drawing.curves import MOST_POINTS
from orchestrator.report.thinning import extremes
from orchestrator.results import MemoryRecorder, compare_results
from orchestrator.results.result import Result
from orchestrator.studio.project import Project
from orchestrator.studio.swap_drive import DRIVES, RECORDED, Waves, converted, recorded
from orchestrator.studio.swap_interface import interface_rows

Say = Callable[[str], None]

SIDES = ("old", "new")
RECORDING = "recording"
RESULT = "swap.json"
DEFAULT_STOP_S = 10.0
# Solvers of different makes differ by less of a signal's range; who wants more says so.
DEFAULT_TOLERANCE = 1e-3
STEPS = 1000
MOST_CURVES = 8


@dataclass(frozen=True, eq=False)
class SideRun:
    """One FMU's run, with signals under the old one's names; `error` says why there is none."""

    result: Result | None
    outcome: RunOutcome | None
    error: str = ""


def file_of(project: Project, side: str) -> Path | None:
    """The FMU of a side, or the file of recorded inputs; None while there is none."""
    return next(iter(sorted((project.folder / side).glob("*.*" if side == RECORDING else "*.fmu"))), None)


def swap(project: Project, say: Say) -> None:
    """Compare both FMUs of a project and write `swap.json`; a run that fails is part of the result."""
    files = [file_of(project, side) for side in SIDES]
    if None in files:
        raise MisfitError("there are no two FMUs to compare; drop in both")
    say("reading both interfaces")
    old, new = (read_description(Path(str(file)).resolve()) for file in files)
    report, change = interface_report(old, new), interface_change(old, new)
    settings = project.settings
    chosen = settings.get("drive", next(iter(DRIVES)))
    inputs, recording = _common_inputs(old, report), file_of(project, RECORDING)
    waves: Waves = {}
    if chosen == RECORDED:
        if recording is None:
            raise MisfitError(
                "no recorded inputs are there; drop in a file with a column time and columns named like inputs"
            )
        waves = recorded(inputs, recording)
    length = max((wave["times"][-1] for wave in waves.values()), default=None)
    stop = float(settings.get("stop") or length or old.stop_time or DEFAULT_STOP_S)
    waves = waves or DRIVES[chosen](inputs, stop)
    runs = []
    for side, description in zip(SIDES, (old, new), strict=True):
        say(f"running {description.path.name}")
        runs.append(
            _run(side, description, report, stop, waves if side == "old" else _for_new(waves, report, old, new))
        )
    document = {
        "files": [old.path.name, new.path.name],
        "matched": sum(not match.conversion for match in report.matches),
        "rows": [asdict(row) for row in interface_rows(old.ports, new.ports, report.matches)],
        "level": change.level,
        "breaking": list(change.breaking),
        "compatible": list(change.compatible),
        "stop": stop,
        "drive": chosen,
        "driven": sorted(waves),
        "runs": [_speed(run) for run in runs],
        **_parting(runs, float(settings.get("tolerance") or DEFAULT_TOLERANCE)),
    }
    write_atomically(project.results / RESULT, json.dumps(plain(document)).encode())


def _common_inputs(old: FmuDescription, report: SwapReport) -> list[Port]:
    """The numbers among the inputs that both have, as the old one declares them."""
    common = {match.old for match in report.matches if match.causality == "input"}
    return [port for port in old.ports if port.name in common and port.type in FLOATS and not port.shape]


def _for_new(waves: Waves, report: SwapReport, old: FmuDescription, new: FmuDescription) -> Waves:
    """The same movements in the units that the new one has for these inputs."""
    names = {match.old: match.new for match in report.matches}
    found: Waves = {}
    for name, wave in waves.items():
        one, other = old.by_name[name][0], new.by_name[names[name]][0] if names[name] in new.by_name else None
        known = other is not None and one.unit and other.unit
        factor, offset = unit_scaling(one, other) if other is not None and known else (1.0, 0.0)
        found[name] = wave if (factor, offset) == (1.0, 0.0) else converted(wave, factor, offset)
    return found


def _run(side: str, description: FmuDescription, report: SwapReport, stop: float, waves: Waves) -> SideRun:
    """Run one side; `waves` drive inputs under the old one's names, in its own units."""
    renamed = {match.new: match.old for match in report.matches} if side == "new" else {}
    known = {p.name for p in description.ports if p.type in FLOATS and not p.shape}
    names = {match.old: match.new if side == "new" else match.old for match in report.matches}
    driven = {names[name]: wave for name, wave in waves.items() if names[name] in known}
    options: dict[str, Any] = {"stop": stop, "step": stop / STEPS, "inputs": driven}
    recorder = MemoryRecorder()
    try:
        system = system_of(case_of(side, description.path.parent / "case.toml", description.path.name, options))
        outcome = run_system(system, recorder, RunOptions(isolate=True))
    except MisfitError as error:
        return SideRun(None, None, str(error))
    return SideRun(_under_names(recorder.result(), renamed), outcome)


def _under_names(result: Result, renamed: dict[str, str]) -> Result:
    """A result whose columns are named by variable, without the component, as the old FMU names them."""
    columns, arrays = [], {}
    for column in result.columns:
        component, _, variable = column.name.partition(".")
        if component == DRIVE:
            continue  # what drives the inputs proves nothing
        variable = variable or column.name
        name = renamed.get(variable, variable)
        columns.append(replace(column, name=name))
        arrays[name] = result[column.name]
    return Result(result.time, tuple(columns), arrays)


def _speed(run: SideRun) -> dict[str, Any]:
    if run.outcome is None:
        return {"error": run.error}
    found = run.outcome
    simulated = found.end - found.start
    return {
        "error": "",
        "simulated_s": simulated,
        "seconds": found.seconds,
        "preparing_s": found.preparing,
        "times_real_time": simulated / found.seconds if found.seconds else None,
        "ended": found.ended,
    }


def _parting(runs: list[SideRun], tolerance: float) -> dict[str, Any]:
    """Where signals part, the first to part first, and curves to draw."""
    first, second = (run.result for run in runs)
    if first is None or second is None:
        return {"tolerance": tolerance, "signals": [], "curves": []}
    try:
        compared = compare_results(first, second, tolerance)
    except MisfitError as error:
        return {"tolerance": tolerance, "signals": [], "curves": [], "not_compared": str(error)}
    signals = sorted(compared.signals, key=lambda s: (s.parted_at is None, s.parted_at or 0.0, -s.largest))
    curves = [_curve(first, second, signal.name) for signal in signals[:MOST_CURVES]]
    return {"tolerance": tolerance, "signals": [asdict(signal) for signal in signals], "curves": curves}


def _curve(first: Result, second: Result, name: str) -> dict[str, Any]:
    """Both curves at the times that keep the shape of both; the second is read at the times of the first."""
    old = np.asarray(first[name], dtype=float)
    units = [result.column(name).unit for result in (second, first)]
    factor = conversion(*units) if all(units) else 1.0
    new = factor * np.interp(first.time, second.time, np.asarray(second[name], dtype=float))
    keep = np.unique(np.concatenate([extremes(old, MOST_POINTS), extremes(new, MOST_POINTS)]))
    return {"name": name, "time": first.time[keep].tolist(), "old": old[keep].tolist(), "new": new[keep].tolist()}
