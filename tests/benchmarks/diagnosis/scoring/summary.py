"""Scores over many cases, beside their targets."""

from collections.abc import Callable, Sequence
from statistics import median
from typing import Any

from tests.benchmarks.diagnosis.scoring.utility import utility
from tests.benchmarks.diagnosis.scoring.wilson import Share

Row = dict[str, Any]
ENOUGH = 1.5


def summary(rows: Sequence[Row]) -> list[tuple[str, str, str]]:
    """(score, target "at least / aim", measured) for every score that the cases allow."""
    of = _by_family(rows)
    rich = [r for r in of("S") if r["enr"] >= ENOUGH]
    weak = [r for r in of("S") if r["enr"] < ENOUGH]
    pairs, named = [r for r in of("D") if r["enr"] >= ENOUGH * 0.95], of("S") + of("D") + of("T")
    sets = rich + of("D") + of("T")
    parameters = [p for r in rich for p in r["parameters"]]
    return [
        ("false alarm, nominal exactly (N0)", "5 / 3 %", str(_alarms(of("N0")))),
        ("false alarm, +-5 % parameters (N1)", "10 / 5 %", str(_alarms(of("N1")))),
        ("false alarm, ugly noise (N2)", "10 / 5 %", str(_alarms(of("N2")))),
        ("of all these: an effect named", "", str(Share.of(bool(r["said"]) for r in of("N0") + of("N1") + of("N2")))),
        (f"single, ENR < {ENOUGH}: not called adequate", "", str(Share.of(r["verdict"] != "adequate" for r in weak))),
        ("single: class", "95 / 99 %", str(Share.of(r["class"] for r in rich))),
        ("single: name", "85 / 93 %", str(Share.of(r["exact"] for r in rich))),
        ("single: name and site", "", str(Share.of(r["exact_site"] for r in rich))),
        (
            "single: name, where the tool tried the effect at all",
            "",
            str(Share.of(r["exact"] for r in rich if r["offered"])),
        ),
        ("single: in top 3", "98 / 99.5 %", str(Share.of(r["top3"] for r in rich))),
        ("single: missed (called adequate)", "", str(Share.of(r["verdict"] == "adequate" for r in rich))),
        ("pair: exact class", "80 / 92 %", str(Share.of(r["class"] for r in pairs))),
        ("pair: exact names", "60 / 75 %", str(Share.of(r["exact"] for r in pairs))),
        ("pair: both in the set", "", str(Share.of(r["superset"] for r in pairs))),
        ("pair: share of the union that is right (Jaccard)", "", _mean([r["jaccard"] for r in pairs])),
        ("triple: exact names", "", str(Share.of(r["exact"] for r in of("T")))),
        ("effects too many, a case with an answer", "0.15 / 0.05", _mean([r["extra"] for r in named if r["said"]])),
        ("outside the library: found", "85 / 95 %", str(Share.of(r["verdict"] == "unknown" for r in of("O")))),
        ("false unknown", "10 / 5 %", str(Share.of(r["verdict"] == "unknown" for r in sets))),
        ("parameter error, median", "5 / 2 %", _percent(_middle([error for error, _ in parameters]))),
        ("parameters within 10 %", "", str(Share.of(error < 0.1 for error, _ in parameters))),
        ("90 % intervals that cover", "80-97 / 87-93 %", str(Share.of(covered for _, covered in parameters))),
        ("reducible held-out error removed, median", "90 / 97 %", _percent(_middle([r["removed"] for r in rich]))),
        ("held-out error / true model's, median", "1.3 / 1.1", _number(_middle([r["over_true"] for r in rich]))),
        ("made worse on held-out trials", "2 / 0.5 %", str(Share.of(bool(r["worse"]) for r in named))),
        ("no excitation: cannot tell", "80 / 95 %", str(Share.of(r["verdict"] == "cannot_tell" for r in of("I")))),
        ("the same, or a class that holds the effect", "", str(Share.of(_careful(r) for r in of("I")))),
        ("no excitation: an experiment is advised", "", str(Share.of(r["advised"] for r in of("I")))),
        ("expected calibration error of probabilities", "0.10 / 0.05", _number(_calibration(rows))),
        ("usefulness of an answer, mean (1: the truth, -0.5: misleading)", "", _mean([utility(r) for r in rows])),
        ("runs that failed", "0", str(Share.of(bool(r["failed"]) for r in rows))),
        ("seconds a case, arm, median", "60 / 15 (2 cores)", _number(_seconds(rows, True, "seconds"))),
        ("the same, of processor time", "", _number(_seconds(rows, True, "cpu_seconds"))),
        ("seconds of processor time, other machines, median", "", _number(_seconds(rows, False, "cpu_seconds"))),
    ]


def _by_family(rows: Sequence[Row]) -> Callable[[str], list[Row]]:
    """Rows of a family; cases drawn for the map of ENR and record length do not count."""
    return lambda family: [r for r in rows if r["family"] == family and r["wanted_enr"] is None]


def by_size(rows: Sequence[Row]) -> list[tuple[str, str, str, str, str]]:
    """(ENR, not called adequate, class, name, in top 3) of single effects by their size."""
    bands = ((0.0, 0.5), (0.5, 1.5), (1.5, 5.0), (5.0, 15.0), (15.0, float("inf")))
    found = []
    for low, high in bands:
        part = [r for r in rows if r["family"] == "S" and low <= r["enr"] < high]
        if part:
            detected = Share.of(r["verdict"] != "adequate" for r in part)
            shares = [detected, *(Share.of(bool(r[key]) for r in part) for key in ("class", "exact", "top3"))]
            found.append((f"{low:g} to {high:g}" if high < float("inf") else f"over {low:g}", *map(str, shares)))
    return found


def _careful(row: Row) -> bool:
    return row["verdict"] == "cannot_tell" or (row["verdict"] == "ambiguous" and row["class"])


def _alarms(rows: Sequence[Row]) -> Share:
    return Share.of(r["verdict"] != "adequate" for r in rows)


def _middle(values: Sequence[float | None]) -> float | None:
    known = [value for value in values if value is not None]
    return median(known) if known else None


def _mean(values: Sequence[float]) -> str:
    return f"{sum(values) / len(values):.2f}" if values else "-"


def _seconds(rows: Sequence[Row], arm: bool, key: str) -> float | None:
    return _middle([r[key] for r in rows if (r["model"] == "arm") == arm])


def _calibration(rows: Sequence[Row], bins: int = 5) -> float | None:
    """Mean over cases with effects of |share right - mean probability| in bins of the first rank's probability."""
    known = [(r["probability"], r["probability_right"]) for r in rows if r["probability"] is not None and r["true"]]
    if len(known) < 4 * bins:
        return None
    total = 0.0
    for k in range(bins):
        inside = [(p, right) for p, right in known if k / bins <= p < (k + 1) / bins or (k == bins - 1 and p == 1)]
        if inside:
            total += abs(sum(p for p, _ in inside) - sum(right for _, right in inside))
    return total / len(known)


def _percent(value: float | None) -> str:
    return "-" if value is None else f"{100 * value:.1f} %"


def _number(value: float | None) -> str:
    return "-" if value is None else f"{value:.3g}"
