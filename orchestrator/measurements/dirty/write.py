"""Write a plan: the case.toml, and copies of files that lie elsewhere."""

import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from fmus.errors import MisfitError
from fmus.files import write_atomically
from orchestrator.measurements.dirty.plan import Plan, times_of
from orchestrator.measurements.dirty.reading import Reading
from orchestrator.measurements.toml_values import toml_literal, toml_pairs

MADE = "# Written by `misfit import`; change it as you like."


def case_text(plan: Plan, names: Sequence[str]) -> str:
    """Write a plan as a case.toml; `names` are those of the files in its folder, in the order of the plan."""
    lines = [MADE, f"files = {toml_literal(list(names))}", *_split(plan)]
    rates = [file.rate_hz for file in plan.files if file.reading.time_kind == "counted"]
    if rates:
        lines += ["", "[sampling]", f"rate_hz = {toml_literal(rates[0])}"]
    lines += _table("columns", plan.units)
    lines += _table("variables", plan.variable_of)
    lines += _table("interpolation", plan.interpolation)
    readings = [file.reading.as_table() for file in plan.files]
    common = {k: v for k, v in readings[0].items() if v != _default(k) or k in ("encoding", "separator", "decimal")}
    lines += _table("reading", common)
    for name, reading in zip(names, readings, strict=True):
        other = {k: v for k, v in reading.items() if v != common.get(k, _default(k))}
        lines += _table(f"reading.files.{toml_literal(name)}", other)
    return "\n".join(lines) + "\n"


def _default(key: str) -> Any:
    return Reading().as_table()[key]


def _split(plan: Plan) -> list[str]:
    """The last third is held out: of the trials, or of the time of a single record."""
    number = len(plan.files)
    times = times_of(plan)
    if number > 1:
        held_out = list(plan.held_out) or list(range(number - math.ceil(number / 3) + 1, number + 1))
        return [
            f"learning = {toml_literal([n for n in range(1, number + 1) if n not in held_out])}",
            f"held_out = {toml_literal(held_out)}",
        ]
    time = times[0]
    start, stop = float(time[0]), float(time[-1] + (time[-1] - time[-2]))
    late = time[time >= start + (time[-1] - start) * 2 / 3]
    if len(late) < 2 or len(time) - len(late) < 2:
        return ["learning = [1]", "held_out = []"]
    cut, start, stop = (float(f"{value:.12g}") for value in (late[0], start, stop))
    return [f"learning_window_s = {toml_literal([start, cut])}", f"held_out_window_s = {toml_literal([cut, stop])}"]


def _table(name: str, values: Mapping[str, Any]) -> list[str]:
    if not values:
        return []
    return ["", f"[{name}]", *toml_pairs(values)]


CASE = "case.toml"


def home_of(paths: Sequence[Path]) -> Path:
    """The folder of the files, where case.toml belongs if nothing else is said.

    Raises:
        MisfitError: they lie in several folders.
    """
    folders = {(path if path.is_dir() else path.parent).resolve() for path in paths}
    if len(folders) > 1:
        raise MisfitError(
            f"the files lie in {len(folders)} folders; say with --out DIR where case.toml and copies of them go"
        )
    return paths[0] if paths[0].is_dir() else paths[0].parent


def require_free(folder: Path) -> None:
    """Refuse to write over a case.toml that was written by hand.

    Raises:
        MisfitError: there is one.
    """
    case = folder / CASE
    if case.exists() and not case.read_text(errors="replace").startswith(MADE):
        raise MisfitError(
            f"{case} exists and was not written by `misfit import`; choose another folder with --out DIR, or remove it"
        )


def write_plan(plan: Plan, folder: Path) -> Path:
    """Write case.toml into a folder, with copies of files that lie elsewhere; returns its path.

    Raises:
        MisfitError: a hand-written case.toml is there, or two files have one name.
    """
    require_free(folder)
    names = [file.path.name for file in plan.files]
    twice = {name for name in names if names.count(name) > 1}
    if twice:
        raise MisfitError(f"two files are named {min(twice)!r}; rename one, as both go into {folder}")
    text = case_text(plan, names)
    folder.mkdir(parents=True, exist_ok=True)
    for file in plan.files:
        target = folder / file.path.name
        if target.resolve() != file.path.resolve():
            write_atomically(target, file.path.read_bytes())
    write_atomically(folder / CASE, text.encode())
    return folder / CASE
