"""What an import will do: how each file is read, which column is which variable, what is learned from, and the case.toml."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from fmus.errors import MisfitError
from orchestrator.measurements.dirty.assign import Assigned, assign
from orchestrator.measurements.dirty.files import FoundFile, find_file
from orchestrator.measurements.load import TEXT_ENDINGS, TYPED_ENDINGS
from orchestrator.measurements.trial import Array
from orchestrator.measurements.wording import listed, nearest

if TYPE_CHECKING:
    from fmus.symbolic.system import Variable


# A held signal repeats more samples than this share, and its steps are larger than the last digit of a slow one.
REPEATS = 0.5
LAST_DIGIT = 2.5
LARGE = 0.05
# Rounding that makes a signal repeat itself lets it jump by a few digits at most; larger steps that differ are commands.
MANY_DIGITS = 20.0


def proposed_interpolation(values: Array) -> str:
    """Propose "hold" if a signal stays for several samples and then jumps, else "linear".

    A slow signal with few digits also repeats samples, but then changes by one digit at a time. Commands that are updated
    every few samples may change little each time, but by many digits, and stand still between any two changes.

    Example:
        >>> proposed_interpolation(np.repeat([0.0, 1.0, 0.3, 0.8], 10))
        'hold'
        >>> proposed_interpolation(np.repeat(np.sin(np.linspace(0, 6, 100)), 5))
        'hold'
        >>> proposed_interpolation(np.clip(np.sin(np.linspace(0, 30, 300)), -0.3, 0.3))
        'linear'
        >>> proposed_interpolation(np.round(np.sin(np.linspace(0, 3, 200)), 1))
        'linear'
    """
    known = values[~np.isnan(values)]
    if len(known) < 3 or np.ptp(known) == 0.0:
        return "linear"
    steps = np.abs(np.diff(known))
    moves = np.flatnonzero(steps > 1e-12 * np.ptp(known))
    jumps = steps[moves]
    if len(jumps) > (1.0 - REPEATS) * len(steps):
        return "linear"
    if len(jumps) > 1 and float(np.median(np.diff(moves))) <= 1.0:
        return "linear"  # it runs and rests
    digit = float(jumps.min())
    if float(np.median(jumps)) > MANY_DIGITS * digit:
        return "hold"
    jumping = float(np.median(jumps)) > LAST_DIGIT * digit or digit > 2 * LARGE * float(np.ptp(known))
    return "hold" if jumping and float(np.median(jumps)) > LARGE * float(np.ptp(known)) else "linear"


@dataclass(frozen=True)
class Wishes:
    """What the user says: `variables` column -> variable ("": none), `units` and `interpolation` by column.

    `rate_hz` serves files without a clock, `time` names the column that holds it, `bridge_up_to_s` the longest hole that is
    bridged (0: every hole is cut out), `held_out` the trial numbers that are kept for the final score.
    """

    variables: Mapping[str, str] = field(default_factory=dict)
    units: Mapping[str, str] = field(default_factory=dict)
    interpolation: Mapping[str, str] = field(default_factory=dict)
    rate_hz: float | None = None
    time: str | None = None
    bridge_up_to_s: float | None = None
    held_out: tuple[int, ...] = ()


@dataclass(frozen=True)
class Plan:
    """An import as proposed: files, columns that all of them have, their units, and what becomes of each.

    `assigned` is empty without a model; `interpolation` has the inputs (without a model: any columns) that stay and jump, and what
    the user said. The course of all others is open: model and record tell it later, where they can.
    """

    files: tuple[FoundFile, ...]
    columns: tuple[str, ...]
    units: Mapping[str, str]
    assigned: tuple[Assigned, ...]
    interpolation: Mapping[str, str]
    inputs: tuple[str, ...]
    held_out: tuple[int, ...]
    notes: tuple[str, ...]

    @property
    def variable_of(self) -> dict[str, str]:
        """Column -> variable."""
        return {each.column: each.variable for each in self.assigned}


def data_files(paths: Sequence[Path]) -> list[Path]:
    """The data files that are meant by files and folders.

    Raises:
        MisfitError: one does not exist, or a folder holds none.
    """
    found: list[Path] = []
    for path in paths:
        if path.is_dir():
            inside = sorted(
                p for p in path.iterdir() if p.suffix.lower() in (*TEXT_ENDINGS, *TYPED_ENDINGS) and p.name[0] != "."
            )
            if not inside:
                raise MisfitError(
                    f"{path}: no data file in this folder; expected {', '.join((*TEXT_ENDINGS, *TYPED_ENDINGS))}"
                )
            found.extend(inside)
        elif path.is_file():
            found.append(path)
        else:
            raise MisfitError(f"{path}: does not exist; expected recorded trials or a folder of them")
    return list(dict.fromkeys(found))


def proposed_plan(
    paths: Sequence[Path],
    inputs: Sequence["Variable"] = (),
    outputs: Sequence["Variable"] = (),
    wishes: Wishes | None = None,
) -> Plan:
    """Look at files and propose how they become a measurement set; what the user says goes first.

    Args:
        paths: files and folders.
        inputs: inputs of the model, if there is one.
        outputs: its outputs.
        wishes: what the user has said of columns, units and trials.

    Raises:
        MisfitError: a file is no table of numbers or has no time, the files have no column in common, or a wish names a
            column or variable that does not exist.
    """
    wishes = wishes or Wishes()
    files, skipped = _found(paths, wishes)
    if wishes.bridge_up_to_s is not None:
        files = tuple(replace(f, reading=replace(f.reading, bridge_up_to_s=wishes.bridge_up_to_s)) for f in files)
    columns, notes = _common(files)
    _require_known(wishes, columns, [v.name for v in (*inputs, *outputs)])
    units = {c: u for c in columns for u in [wishes.units.get(c) or _unit(files, c)] if u}
    assigned = assign(columns, units, (*inputs, *outputs), wishes.variables) if inputs or outputs else ()
    driving = {v.name for v in inputs}
    driven = tuple(each.column for each in assigned if each.variable in driving)
    looked_at = driven if assigned else columns
    held = {c: "hold" for c in looked_at if proposed_interpolation(files[0].columns[c]) == "hold"}
    interpolation = held | {column: how for column, how in wishes.interpolation.items() if how}
    _require_held_out(wishes.held_out, len(files))
    return Plan(files, columns, units, assigned, interpolation, driven, wishes.held_out, (*skipped, *notes))


def _found(paths: Sequence[Path], wishes: Wishes) -> tuple[tuple[FoundFile, ...], list[str]]:
    """All files, and which of a folder's were no tables, such as a readme.txt."""
    found: list[FoundFile] = []
    skipped: list[str] = []
    trouble: MisfitError | None = None
    for path in data_files(paths):
        try:
            found.append(find_file(path, wishes.rate_hz, wishes.time))
        except MisfitError as error:
            if path in paths or path.suffix.lower() not in TEXT_ENDINGS[1:]:
                raise
            skipped.append(f"{path.name} is no table of numbers and left out")
            trouble = error
    if not found and trouble is not None:
        raise trouble
    return tuple(found), skipped


def _require_held_out(numbers: Sequence[int], n_files: int) -> None:
    if numbers and n_files == 1:
        raise MisfitError("there is one file, of which the last third is held out; trial numbers need several files")
    if any(not 1 <= n <= n_files for n in numbers) or len(set(numbers)) >= n_files > 1:
        raise MisfitError(
            f"held-out trials {list(numbers)}: expected numbers from 1 to {n_files}, and one left to learn from"
        )


def _common(files: Sequence[FoundFile]) -> tuple[tuple[str, ...], tuple[str, ...]]:
    columns = tuple(c for c in files[0].columns if all(c in f.columns for f in files))
    if not columns:
        other = next(f for f in files if not set(f.columns) & set(files[0].columns))
        raise MisfitError(
            f"{files[0].path.name} and {other.path.name} have no column in common ({listed(files[0].columns)}; {listed(other.columns)}); import them one by one"
        )
    lost = sorted({c for f in files for c in f.columns} - set(columns))
    notes = [f"columns that not all files have are left out: {listed(lost)}"] if lost else []
    return columns, tuple(dict.fromkeys([*notes, *(note for f in files for note in f.notes)]))


def _unit(files: Sequence[FoundFile], column: str) -> str:
    stated = {f.units.get(column, "") for f in files} - {""}
    if len(stated) > 1:
        raise MisfitError(f"column {column!r} is in {listed(sorted(stated))}; import files of one unit together")
    return next(iter(stated), "")


def _require_known(wishes: Wishes, columns: Sequence[str], variables: Sequence[str]) -> None:
    for column in (*wishes.variables, *wishes.units, *wishes.interpolation):
        if column not in columns:
            raise MisfitError(f"there is no column {column!r}; {nearest(column, columns)}")
    for variable in wishes.variables.values():
        if variable and variable not in variables:
            raise MisfitError(f"the model has no input or output {variable!r}; {nearest(variable, variables)}")


def times_of(plan: Plan) -> list[np.ndarray]:
    """Time of each file as it will be used, s; counted where there is no clock."""
    found = []
    for file in plan.files:
        table = file.table(tuple(plan.variable_of), plan.interpolation)
        counted = file.reading.time_kind == "counted"
        found.append(np.arange(len(table.lines)) / (file.rate_hz or 1.0) if counted else table.values[:, 0])
    return found
