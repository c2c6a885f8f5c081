"""The same mutants seen by others: FMPy's own validation with its defaults, and the tolerances of csv-compare."""

import json
from collections.abc import Iterable
from pathlib import Path

import numpy as np

from fmus.files import write_atomically
from orchestrator.regress.comparison import Signal, Tolerance, compare_signals
from tests.benchmarks.regress.mutants.campaign import Fate
from tests.benchmarks.regress.mutants.effect import simulated
from tests.benchmarks.regress.mutants.subjects import Subject

FMPY = "FMPy 0.3 validate_result, its defaults, any sample outside"
CSV_COMPARE = "the tube of csv-compare, its defaults, missing and long records aside"


def seen_by_others(subject: Subject, folder: Path, fates: Iterable[Fate]) -> dict[str, dict[str, bool]]:
    """Return for each mutant that should be caught which of the others sees it; kept in peers.json."""
    kept = folder / "peers.json"
    found: dict[str, dict[str, bool]] = json.loads(kept.read_text()) if kept.is_file() else {}
    original = simulated(subject, folder / "base/base.fmu")
    for fate in fates:
        if fate.state in ("killed", "survived") and fate.name not in found:
            found[fate.name] = _seen(subject, original, folder / "mutants" / f"{fate.name}.fmu")
    write_atomically(kept, json.dumps(found, indent=1).encode())
    return found


def _seen(subject: Subject, original: dict[str, np.ndarray], fmu: Path) -> dict[str, bool]:
    try:
        result = simulated(subject, fmu)
    except Exception:  # a run that ends with an error is seen by everybody
        return {FMPY: True, CSV_COMPARE: True}
    if any(len(result[name]) != len(original[name]) for name in original):
        return {FMPY: True, CSV_COMPARE: True}
    return {FMPY: _fmpy_sees(subject, original, result), CSV_COMPARE: _csv_compare_sees(subject, original, result)}


def _fmpy_sees(subject: Subject, original: dict[str, np.ndarray], result: dict[str, np.ndarray]) -> bool:
    from fmpy.util import validate_result

    return bool(validate_result(_table(subject, result), _table(subject, original)) > 0.0)


def _table(subject: Subject, columns: dict[str, np.ndarray]) -> np.ndarray:
    count = len(next(iter(columns.values())))
    table = np.zeros(count, dtype=[("time", float), *((name, float) for name in columns)])
    table["time"] = np.arange(count) * subject.step_s
    for name, column in columns.items():
        table[name] = column
    return table


def _csv_compare_sees(subject: Subject, original: dict[str, np.ndarray], result: dict[str, np.ndarray]) -> bool:
    """Half-width 0.002 of the time, half-height 0.002 of the larger of range, |smallest value| and 0.001; NaN passes."""
    for name, expected in original.items():
        time = np.arange(len(expected)) * subject.step_s
        size = max(float(np.ptp(expected)), abs(float(expected.min())), 0.001)
        tolerance = Tolerance(0.002 * size, 0.0, 0.002 * subject.stop_s)
        found = np.where(np.isfinite(result[name]), result[name], expected)
        if not compare_signals(Signal(name, time, found), Signal(name, time, expected), tolerance).passed:
            return True
    return False
