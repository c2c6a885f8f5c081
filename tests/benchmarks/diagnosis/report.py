"""The report of a run: a markdown file, its picture, and the same figures as JSON."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from tests.benchmarks.diagnosis.baselines.methods import METHODS
from tests.benchmarks.diagnosis.diagnose_cases import write_json
from tests.benchmarks.diagnosis.scoring.baselines import COLUMNS, as_rows, method_scores
from tests.benchmarks.diagnosis.scoring.confusion import confusion
from tests.benchmarks.diagnosis.scoring.heat_map import draw_map, map_cells, map_table
from tests.benchmarks.diagnosis.scoring.summary import by_size, summary
from tests.benchmarks.diagnosis.truth.families import FAMILIES

_HEAD = """# How far the diagnosis can be trusted

Made by `make bench-diagnosis`; every figure below was measured, none is written by hand. {about}

A separate simulator (`tests/benchmarks/diagnosis/truth`, plain C, MuJoCo for linked bodies) makes six trials of each
case, four to learn from and two held out; `misfit diagnose` sees the recordings only. ENR is the effect's size: rms of
what it changes in a free run from the true start, over the rms of what sensor noise and carried input noise leave there.
Shares are given with Wilson's 95 % interval. A case counts as a single or a pair here from an ENR of 1.5 for each of its
effects. "Class" accepts a declared group of at most three effects.
"""

_SAME = """The same library of effects on the same recordings: the {n} cases on which all methods ran. A method raises a false
alarm here when it names an effect; "unknown" and a run that failed do not count as names in this table."""


def write_report(
    rows: Sequence[dict[str, Any]], named: Mapping[str, Mapping[str, Any]], about: str, markdown: Path, figures: Path
) -> None:
    """Write `markdown` with the picture of the map beside it, and all figures and judgements as JSON to `figures`."""
    scores = summary(rows)
    shared = [row for row in rows if named.get(row["case"])]
    methods = {"misfit diagnose": shared, **{name: as_rows(shared, named, name) for name in METHODS}}
    lines = [_HEAD.format(about=about), _counts(rows), "", "| score | at least / aim | measured |", "|---|---|---|"]
    lines += [f"| {score} | {target} | {found} |" for score, target, found in scores]
    lines += ["", "## Single effects by size", ""]
    lines += ["| ENR | not called adequate | class | name | in top 3 |", "|---|---|---|---|---|"]
    lines += ["| " + " | ".join(row) + " |" for row in by_size(rows)]
    lines += ["", "## Beside other methods", "", _SAME.format(n=len(shared)), ""]
    lines += ["| method | " + " | ".join(COLUMNS) + " |", "|---" * (len(COLUMNS) + 1) + "|"]
    lines += [f"| {name} | " + " | ".join(method_scores(part)) + " |" for name, part in methods.items()]
    lines += ["", "## Answers", "", "| truth | answers | cases |", "|---|---|---|"]
    lines += [f"| {truth} | {answers} | {n} |" for truth, answers, n in confusion(rows)]
    panels = {name: map_cells(part) for name, part in methods.items() if map_cells(part)}
    if panels:
        picture = markdown.with_name(f"{markdown.stem}_map.png")
        draw_map({name: cells for name, cells in panels.items() if name != "random"}, picture)
        lines += ["", "## Size of the effect and length of a trial", "", f"![right at class level]({picture.name})", ""]
        lines += [map_table(panels["misfit diagnose"])]
    failed = [r for r in rows if r["failed"]]
    if failed:
        lines += ["", "## Runs that failed", ""]
        lines += [f"* {r['case']}: {r['failed'].splitlines()[-1][:200]}" for r in failed]
    markdown.parent.mkdir(parents=True, exist_ok=True)
    markdown.write_text("\n".join(lines) + "\n")
    measured = [{"score": score, "target": target, "measured": found} for score, target, found in scores]
    write_json(figures, {"about": about, "scores": measured, "cases": list(rows)})


def _counts(rows: Sequence[dict[str, Any]]) -> str:
    plain = [r for r in rows if r["wanted_enr"] is None]
    counts = [
        f"{family} ({meaning}): {sum(r['family'] == family for r in plain)}" for family, meaning in FAMILIES.items()
    ]
    return "Cases: " + "; ".join(counts) + f"; for the map: {len(rows) - len(plain)}."
