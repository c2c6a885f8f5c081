"""Move each threshold of the balance-equation search by a factor of two either way, and count the answers that change.

Run from the repository's root, about half a minute of processor time a threshold and pair of cases:

    python -m tests.benchmarks.house.moved_thresholds [CASE ...] [--out FILE.md]

Cases are names of tests/cases/gallery; each is run with its effect and without (null).
"""

import argparse
from collections.abc import Sequence
from dataclasses import fields, replace
from pathlib import Path

from fmus.catalogue import ModelicaModel
from orchestrator.datacheck.holding import with_interpolation
from orchestrator.greybox.diagnose import diagnose_greybox
from orchestrator.greybox.thresholds import Thresholds
from orchestrator.measurements import MeasurementSet, load_measurements
from orchestrator.models.symbolic import SymbolicModel
from tests.cases.gallery.generate import MACHINES

GALLERY = Path(__file__).parents[2] / "cases" / "gallery"
CASES = ("two_rooms", "reactor")
# (verdict, effects with their sites) of each case.
Answers = tuple[tuple[str, ...], ...]


def prepared(names: Sequence[str]) -> list[tuple[ModelicaModel, MeasurementSet]]:
    """Model and data of each case and of its null."""
    found = []
    for name in names:
        model = ModelicaModel(name, MACHINES[name].class_name, GALLERY / name / "Model.mo")
        plain = SymbolicModel(name, model.compile())
        found += [(model, with_interpolation(plain, load_measurements(GALLERY / d))) for d in (name, f"{name}_null")]
    return found


def answers(cases: Sequence[tuple[ModelicaModel, MeasurementSet]], limits: Thresholds) -> Answers:
    """What is answered under these thresholds."""
    found = [diagnose_greybox(model, data, workers=1, limits=limits) for model, data in cases]
    return tuple((each.verdict, *sorted(f"{e.id} at {e.site}" for e in each.effects)) for each in found)


def moved(limits: Thresholds, name: str, factor: float) -> Thresholds:
    """The thresholds with one of them larger or smaller; whole numbers stay whole and at least 1."""
    value = getattr(limits, name)
    other = max(1, round(value * factor)) if isinstance(value, int) else value * factor
    return replace(limits, **{name: other})


def changes(usual: Answers, other: Answers) -> str:
    """How many answers differ, and which way the first one does."""
    different = [(was, now) for was, now in zip(usual, other, strict=True) if was != now]
    if not different:
        return "no change"
    was, now = different[0]
    return f"{len(different)} of {len(usual)}: {was[0]} -> {', '.join(now)}"


def main() -> None:
    """Print a table as it grows; with `--out` write it, too."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("cases", nargs="*", default=list(CASES))
    parser.add_argument("--out", type=Path)
    asked = parser.parse_args()
    cases, limits = prepared(asked.cases), Thresholds()
    usual = answers(cases, limits)
    rows = ["| threshold | value | half of it | twice of it |", "|---|---|---|---|"]
    print("\n".join([str(usual), *rows]), flush=True)
    for field in fields(Thresholds):
        cells = [changes(usual, answers(cases, moved(limits, field.name, factor))) for factor in (0.5, 2.0)]
        rows.append(f"| `{field.name}` | {getattr(limits, field.name):g} | {cells[0]} | {cells[1]} |")
        print(rows[-1], flush=True)
        if asked.out:
            asked.out.write_text("\n".join(rows) + "\n")


if __name__ == "__main__":
    main()
