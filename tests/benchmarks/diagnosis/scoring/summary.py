"""Scores over many cases, beside their targets."""

from collections.abc import Callable, Sequence
from statistics import median, quantiles
from typing import Any

from tests.benchmarks.diagnosis.scoring.calibration import calibration_error, reliability
from tests.benchmarks.diagnosis.scoring.targets import Band, Score, Target
from tests.benchmarks.diagnosis.scoring.utility import utility
from tests.benchmarks.diagnosis.scoring.wilson import Share

Row = dict[str, Any]
ENOUGH, SEEN = 1.5, 0.5
# Sizes are met within 5 %, so a case that was wanted at a limit counts as being there.
_NEARLY = 0.95


def summary(rows: Sequence[Row]) -> list[tuple[str, list[Score]]]:
    """Scores by theme."""
    return [
        ("Nothing is missing", _nothing(rows)),
        ("One effect is missing", _singles(rows)),
        ("Several effects are missing", _sets(rows)),
        ("An effect that is in no library", _outside(rows)),
        ("Parameters and errors", _fitted(rows)),
        ("Data that cannot tell, and the next experiment", _experiments(rows)),
        ("Probabilities, usefulness and failures", _overall(rows)),
    ]


def singles(rows: Sequence[Row], least: float = ENOUGH) -> list[Row]:
    """Single effects of at least a size, those drawn for the map left out."""
    return [r for r in _of(rows)("S") if r["enr"] >= _NEARLY * least]


def _nothing(rows: Sequence[Row]) -> list[Score]:
    of = _of(rows)
    every = of("N0") + of("N1") + of("N2")
    return [
        Score.share("false alarm, nominal exactly (N0)", _alarms(of("N0")), Target(0.05, 0.03, less=True)),
        Score.share("false alarm, +-5 % parameters (N1)", _alarms(of("N1")), Target(0.10, 0.05, less=True)),
        Score.share("false alarm, ugly noise (N2)", _alarms(of("N2")), Target(0.10, 0.05, less=True)),
        Score.share("of all these: an effect named", Share.of(bool(r["said"]) for r in every)),
        Score.share("of all these: unknown", _verdict(every, "unknown")),
        Score.share("of all these: cannot tell", _verdict(every, "cannot_tell")),
    ]


def _singles(rows: Sequence[Row]) -> list[Score]:
    rich = singles(rows)
    seen = [r for r in rows if r["family"] == "S" and r["enr"] >= _NEARLY * SEEN]
    offered = [r for r in rich if r["offered"]]
    right = [r for r in rich if r["exact"]]
    return [
        Score.share(f"noticed (not adequate), ENR from {SEEN:g}, map included", _alarms(seen), Target(0.90, 0.98)),
        Score.share(f"class, ENR from {ENOUGH:g} here and below", _share(rich, "class"), Target(0.95, 0.99)),
        Score.share("name", _share(rich, "exact"), Target(0.85, 0.93)),
        Score.share("in the top 3 of the ranking", _share(rich, "top3"), Target(0.98, 0.995)),
        Score.share("first in the ranking", _share(rich, "probability_right")),
        Score.share("name, where the model has a place for the effect", _share(offered, "exact")),
        Score.share("in the top 3, where the model has a place for the effect", _share(offered, "top3")),
        Score.share("right site, where the name is right", _share(right, "exact_site"), Target(0.97, 0.99)),
        Score.share("missed (called adequate)", Share.of(r["verdict"] == "adequate" for r in rich)),
    ]


def _sets(rows: Sequence[Row]) -> list[Score]:
    of = _of(rows)
    pairs = [r for r in of("D") if r["enr"] >= _NEARLY * ENOUGH]
    answered = [r for r in of("S") + of("D") + of("T") if r["said"]]
    return [
        Score.share("pair: exact class", _share(pairs, "class"), Target(0.80, 0.92)),
        Score.share("pair: exact names", _share(pairs, "exact"), Target(0.60, 0.75)),
        Score.share("pair: both named", _share(pairs, "superset")),
        Score.share("pair: at least one named", Share.of(r["jaccard"] > 0 for r in pairs)),
        _mean("pair: share of the union of truth and answer (Jaccard)", [r["jaccard"] for r in pairs]),
        Score.share("triple: exact names", _share(of("T"), "exact")),
        _mean(
            "effects too many, a case with an answer",
            [r["extra"] for r in answered],
            Target(0.15, 0.05, less=True),
        ),
    ]


def _outside(rows: Sequence[Row]) -> list[Score]:
    of = _of(rows)
    library = singles(rows) + of("D") + of("T")
    return [
        Score.share("found (unknown, or its law named)", _found(of("O")), Target(0.85, 0.95)),
        Score.share(
            f"found, where the nearest library effect leaves an ENR of {ENOUGH:g} or more",
            _found([r for r in of("O") if r["enr_left"] >= ENOUGH]),
        ),
        Score.share("taken for another effect", Share.of(bool(r["said"]) and not r["exact"] for r in of("O"))),
        Score.share(
            "false unknown, singles, pairs and triples",
            Share.of(r["verdict"] == "unknown" for r in library),
            Target(0.10, 0.05, less=True),
        ),
    ]


def _fitted(rows: Sequence[Row]) -> list[Score]:
    of, rich = _of(rows), singles(rows)
    named = of("S") + of("D") + of("T")
    parameters = [p for r in rich for p in r["parameters"]]
    return [
        _median("parameter error", [e for e, _ in parameters], Target(0.05, 0.02, less=True), percent=True),
        Score.share("parameters within 10 %", Share.of(error < 0.1 for error, _ in parameters)),
        Score.share(
            "90 % intervals that hold the truth",
            Share.of(covered for _, covered in parameters),
            Band((0.80, 0.97), (0.87, 0.93)),
        ),
        _median("reducible held-out error removed", [r["removed"] for r in rich], Target(0.90, 0.97), percent=True),
        _median(
            "held-out error / true model's own, singles", [r["over_true"] for r in rich], Target(1.3, 1.1, less=True)
        ),
        _median("the same, pairs", [r["over_true"] for r in of("D")], Target(1.6, 1.25, less=True)),
        Score.share(
            "made worse on held-out trials", Share.of(bool(r["worse"]) for r in named), Target(0.02, 0.005, less=True)
        ),
    ]


def _experiments(rows: Sequence[Row]) -> list[Score]:
    hidden = _of(rows)("I")
    left = [r for r in rows if r["open"]]
    return [
        Score.share("no excitation (I): cannot tell", _verdict(hidden, "cannot_tell"), Target(0.80, 0.95)),
        Score.share("the same, or a class that holds the effect", Share.of(_careful(r) for r in hidden)),
        Score.share("no excitation: an experiment is advised", _share(hidden, "advised")),
        Score.share(
            "answers left open that one recommended run resolves",
            _share([r for r in left if r["separable"]], "resolved"),
            Target(0.70, 0.85),
        ),
        Score.share(
            "answers left open of which it says that no run tells them apart",
            Share.of(not r["separable"] for r in left),
        ),
        Score.share("all answers left open: resolved by one run", _share(left, "resolved")),
        Score.share(
            "answers left open for which no experiment could be run", Share.of(r["again"] is None for r in left)
        ),
    ]


def _overall(rows: Sequence[Row]) -> list[Score]:
    arm = [r["wall_seconds"] for r in rows if r["model"] == "arm"]
    return [
        _calibration("expected calibration error of probabilities", rows, Target(0.10, 0.05, less=True)),
        _calibration("the same without effects of no library", [r for r in rows if not r["kind"]], None),
        _mean("usefulness of an answer (1: the truth, -0.5: misleading)", [utility(r) for r in rows]),
        Score.share("runs that failed or took too long", Share.of(bool(r["failed"]) for r in rows)),
        _median("seconds for an arm case, one process", arm, Target(60.0, 15.0, less=True)),
    ]


def _calibration(name: str, rows: Sequence[Row], target: Target | None) -> Score:
    error = calibration_error(rows)
    text = "-" if error is None else f"{error:.3g}"
    return Score(name, text, len(reliability(rows)), error, target, percent=False)


def by_size(rows: Sequence[Row]) -> list[tuple[str, Share, Share, Share, Share]]:
    """(ENR, not called adequate, class, name, in top 3) of single effects by their size, the map's included."""
    found = []
    for low, high in BANDS:
        part = [r for r in rows if r["family"] == "S" and low <= r["enr"] < high]
        if part:
            label = f"{low:g} to {high:g}" if high < float("inf") else f"over {low:g}"
            found.append((label, _alarms(part), *(_share(part, key) for key in ("class", "exact", "top3"))))
    return found


def by_kind(rows: Sequence[Row], key: str) -> list[tuple[str, Share, Share, Share, Share, Share]]:
    """(kind, false alarms, class, name, pairs' class, found outside) by what a row says under `key`."""
    found = []
    for kind in dict.fromkeys(str(r[key]) for r in rows):
        own = [r for r in rows if str(r[key]) == kind]
        of, rich = _of(own), singles(own)
        alarms, outside = _alarms(of("N0") + of("N1") + of("N2")), _found(of("O"))
        found.append((kind, alarms, _share(rich, "class"), _share(rich, "exact"), _share(of("D"), "class"), outside))
    return sorted(found)


BANDS = ((0.0, 0.5), (0.5, 1.5), (1.5, 5.0), (5.0, 15.0), (15.0, float("inf")))


def _of(rows: Sequence[Row]) -> Callable[[str], list[Row]]:
    """Rows of a family; cases drawn for the map of ENR and record length do not count."""
    return lambda family: [r for r in rows if r["family"] == family and r["wanted_enr"] is None]


def _careful(row: Row) -> bool:
    return row["verdict"] == "cannot_tell" or (row["verdict"] == "ambiguous" and row["class"])


def _alarms(rows: Sequence[Row]) -> Share:
    return Share.of(r["verdict"] != "adequate" for r in rows)


def _share(rows: Sequence[Row], key: str) -> Share:
    return Share.of(bool(r[key]) for r in rows)


def _found(rows: Sequence[Row]) -> Share:
    return Share.of(r["verdict"] == "unknown" or r["exact"] for r in rows)


def _verdict(rows: Sequence[Row], verdict: str) -> Share:
    return Share.of(r["verdict"] == verdict for r in rows)


def _median(name: str, values: Sequence[float | None], target: Target | None = None, percent: bool = False) -> Score:
    known = [value for value in values if value is not None]
    if not known:
        return Score(f"{name}, median", "-", 0, None, target, percent=percent)
    middle = median(known)
    low, _, high = quantiles(known, n=4) if len(known) > 1 else (middle, middle, middle)
    shown = [f"{100 * x:.1f}" if percent else f"{x:.3g}" for x in (middle, low, high)]
    text = f"{shown[0]}{' %' if percent else ''} (quartiles {shown[1]}, {shown[2]}; n = {len(known)})"
    return Score(f"{name}, median", text, len(known), middle, target, percent=percent)


def _mean(name: str, values: Sequence[float], target: Target | None = None) -> Score:
    if not values:
        return Score(f"{name}, mean", "-", 0, None, target, percent=False)
    value = sum(values) / len(values)
    return Score(f"{name}, mean", f"{value:.2f} (n = {len(values)})", len(values), value, target, percent=False)
