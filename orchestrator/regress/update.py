"""New references from results, with a diff for people to review."""

import io
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from fmus.errors import MisfitError
from fmus.files import write_atomically
from orchestrator.regress.case import Case
from orchestrator.regress.comparison import Signal, SignalVerdict
from orchestrator.regress.interface import CHECK, interface_of, path_beside, write_interface
from orchestrator.regress.outcome import Outcome, WholeVerdict
from orchestrator.regress.prepare import system_of
from orchestrator.results.column import Column


def update_references(cases: Sequence[Case], outcomes: Sequence[Outcome]) -> tuple[list[Outcome], list[str]]:
    """Write the results of cases that differ as their references: the outcomes after that, and what changed, line by line.

    Only references that are files can be written; a case that failed for another reason than its reference stays failed. A
    reference that a component's failure, or a NaN, would get into is left alone.
    """
    by_name = {(str(case.file), case.name): case for case in cases}
    shared = Counter(_target(case) for case in cases if _target(case) is not None)
    after, lines = [], []
    for outcome in outcomes:
        case = by_name.get((outcome.file, outcome.name))
        target = None if case is None else _target(case)
        has_reference = target is None or target.exists()
        if case is not None and target is not None and shared[target] == 1 and _lacks_interface(outcome, target):
            write_interface(target, interface_of(system_of(case)))
            lines.append(f"updated {outcome.name}: {path_beside(target)}: units, types and start values")
        if case is None or not outcome.signals_kept or (outcome.verdict == "passed" and has_reference):
            after.append(outcome)
            continue
        why_not = _why_not(case, outcome, target, shared)
        if why_not or target is None:
            lines.append(f"not updated: {outcome.name}: {why_not}")
            after.append(outcome)
            continue
        names = (case.reference.columns if case.reference else {}) or {}
        write_table(target, outcome.signals_kept, names)
        write_interface(target, interface_of(system_of(case)))
        lines += [f"updated {outcome.name}: {target}", *(f"  {line}" for line in _changes(outcome))]
        after.append(
            replace(outcome, verdict="passed", reason="", problem="", signals=(), curves=(), notes=("updated",))
        )
    return after, lines


def write_table(path: Path, signals: Mapping[str, Signal], names: Mapping[str, str]) -> None:
    """Write signals over time as a whole file; `names` are columns by signal, where they differ.

    Args:
        path: the file, whose ending says which format it has.
        signals: signals over one time.
        names: column of a signal, where it is not its name.

    Raises:
        MisfitError: if the file cannot be written.
    """
    columns = [Column(names.get(name, name), signal.unit) for name, signal in signals.items()]
    time = next(iter(signals.values())).time
    values = np.column_stack([signal.values for signal in signals.values()])
    try:
        if path.suffix.lower() == ".csv":
            write_atomically(path, _csv(columns, time, values))
            return
        from orchestrator.results.recorder import recorder_for

        recorder = recorder_for(path)
        recorder.begin(columns, {})
        recorder.rows(time, values)
        recorder.finish()
    except OSError as error:
        raise MisfitError(f"{path} cannot be written: {error.strerror}; choose another place") from error


def _csv(columns: Sequence[Column], time: np.ndarray, values: np.ndarray) -> bytes:
    """Numbers so that they read back as the same bits."""
    text = io.StringIO()
    names = ("time", *(column.name for column in columns))
    text.write(",".join(f'"{name}"' if "," in name else name for name in names) + "\n")
    for t, row in zip(time.tolist(), values.tolist(), strict=True):
        text.write(",".join(repr(x) for x in (t, *row)) + "\n")
    return text.getvalue().encode()


def _lacks_interface(outcome: Outcome, target: Path) -> bool:
    """Whether a case that passes has a reference from before interfaces were kept."""
    return outcome.verdict == "passed" and target.exists() and not path_beside(target).exists()


def _target(case: Case) -> Path | None:
    return case.reference_file


def _why_not(case: Case, outcome: Outcome, target: Path | None, shared: Mapping[Path | None, int]) -> str:
    assert outcome.signals_kept
    if case.reference is None:
        return "it has no reference"
    if target is None:
        return f"its reference is no file of its own, but {case.reference.kind} {case.reference.source}".rstrip()
    if shared[target] > 1:
        return f"{shared[target]} cases have the reference {target}; give each its own file"
    broken = [name for name, signal in outcome.signals_kept.items() if not np.isfinite(signal.values).all()]
    if broken:
        return f"{', '.join(broken)} would put values that are no numbers into {target}"
    rest: list[WholeVerdict | SignalVerdict] = [
        each for each in outcome.wholes if not each.passed and each.check != CHECK
    ]
    alone = {
        (n, str(getattr(c, "kind", "")))
        for n, several in case.signals.items()
        for c in several
        if not c.needs_reference
    }
    rest += [each for each in outcome.signals if not each.passed and (each.name, each.check) in alone]
    return f"a reference does not mend {rest[0].check}: {rest[0].reason}" if rest else ""


def _changes(outcome: Outcome) -> list[str]:
    """What changed by how much, a line for each signal."""
    verdicts: dict[str, list[SignalVerdict]] = {}
    for verdict in outcome.signals:
        verdicts.setdefault(verdict.name, []).append(verdict)
    lines = [f"{name}: new" for name in outcome.signals_kept if name not in verdicts]
    lines += [f"interface: {each.reason}" for each in outcome.wholes if each.check == CHECK and not each.passed]
    for name, several in verdicts.items():
        worst = next((each for each in several if not each.passed), several[0])
        if name not in outcome.signals_kept:
            lines.append(f"{name}: taken out")
        elif worst.check == "missing":
            lines.append(f"{name}: new")
        else:
            lines.append(f"{name}: {'as before' if worst.passed else worst.reason}")
    return lines
