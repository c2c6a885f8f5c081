"""The report of a run: a markdown file, its pictures, and the same figures as JSON."""

import os
import platform
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from tests.benchmarks.diagnosis.baselines.methods import METHODS
from tests.benchmarks.diagnosis.cases import TIME_IS_UP, Done
from tests.benchmarks.diagnosis.diagnose_cases import write_json
from tests.benchmarks.diagnosis.scoring.baselines import COLUMNS, as_rows, method_scores
from tests.benchmarks.diagnosis.scoring.confusion import answers, confusion_table, draw_confusion
from tests.benchmarks.diagnosis.scoring.cost import cost_table, needed_hours
from tests.benchmarks.diagnosis.scoring.curves import draw_curves
from tests.benchmarks.diagnosis.scoring.heat_map import draw_map, map_cells, map_table
from tests.benchmarks.diagnosis.scoring.summary import ENOUGH, by_kind, by_size, summary
from tests.benchmarks.diagnosis.scoring.targets import Score
from tests.benchmarks.diagnosis.suite import suite
from tests.benchmarks.diagnosis.truth.families import FAMILIES

Row = dict[str, Any]

_HEAD = """# How far the diagnosis can be trusted

Written by `{command}`, which also drew the pictures; no figure below is written by hand. {about}

A separate simulator (`tests/benchmarks/diagnosis/truth`: plain C, MuJoCo for linked bodies) makes six trials of each
case, four to learn from and two held out; `misfit diagnose` sees the recordings only. ENR is the effect's size: rms of
what it changes in a free run from the true start, over the rms of what sensor noise and carried input noise leave there.
Pairs and triples that a smaller set imitates to an ENR below 0.5 are drawn again, and so is what is in no library and yet
imitated by a library effect: no record tells them apart.
Shares come with Wilson's 95 % interval in brackets. "Class" accepts a declared group of at most three effects. A run
that fails or takes too long is a wrong answer, and an alarm where nothing is missing. A target reads "at least / aim";
"not certain" means that the interval holds values on both sides of "at least".
"""

_SAME = """The same library of effects on the same recordings: the {n} cases on which all methods ran (`baselines/`). A method
raises a false alarm here when it names an effect; "unknown" and a run that failed do not count as names in this table.
Usefulness is 1 for the truth, 1/k for a class of k that holds it, 0.3 for a needless "cannot tell", -0.5 for wrong names."""


@dataclass(frozen=True)
class About:
    """A call of the benchmark: `wanted` cases of a `seed` at a `commit`, and the `seconds` that the call took."""

    size: str
    seed: int
    wanted: int
    commit: str
    workers: int
    limit_s: float
    budget_s: float
    seconds: float

    def __str__(self) -> str:
        """Say it in sentences."""
        return (
            f"Commit {self.commit}, {self.workers} processes at a time on {os.cpu_count()} cores ({platform.machine()}, "
            f"load {os.getloadavg()[2]:.1f} over the last 15 minutes), at most {self.limit_s:g} s of processor time a "
            f"diagnosis; this call took {self.seconds:.0f} s."
        )

    @property
    def command(self) -> str:
        """What made the report."""
        budget = f" BUDGET={self.budget_s:g}" if self.budget_s < float("inf") else ""
        return f"make bench-diagnosis SIZE={self.size} SEED={self.seed} WORKERS={self.workers}{budget}"


def write_report(done: Sequence[Done], about: About, markdown: Path, figures: Path) -> None:
    """Write `markdown` with its pictures beside it, and all figures and judgements as JSON to `figures`."""
    rows = [case.row for case in done if case.row is not None]
    named = {case.name: case.baselines for case in done if case.baselines}
    themes = summary(rows)
    lines = [_HEAD.format(command=about.command, about=about)]
    lines += [_counts(rows, about), ""]
    lines += [*_short(themes), *_themes(themes), *_sizes(rows, markdown)]
    lines += [*_beside(rows, named, markdown), *_confused(rows, markdown)]
    lines += [*_kinds(rows), "## What it costs", "", *cost_table(rows), "", _whole(rows), "", *_failures(done)]
    markdown.parent.mkdir(parents=True, exist_ok=True)
    markdown.write_text("\n".join(lines).rstrip() + "\n")
    measured = [
        {"theme": theme, "score": s.name, "target": s.wanted, "measured": s.text, "n": s.n, "reached": s.reached}
        for theme, scores in themes
        for s in scores
    ]
    write_json(figures, {"about": str(about), "scores": measured, "cases": rows})


def _counts(rows: Sequence[Row], about: About) -> str:
    plain = [r for r in rows if r["wanted_enr"] is None]
    counts = [f"{family} ({what}): {sum(r['family'] == family for r in plain)}" for family, what in FAMILIES.items()]
    return (
        f"Size `{about.size}`: {len(rows)} of {about.wanted} cases. "
        + "; ".join(counts)
        + f"; single effects for the map: {len(rows) - len(plain)}."
    )


def _short(themes: Sequence[tuple[str, Sequence[Score]]]) -> list[str]:
    """Where a target is missed, said first."""
    with_target = [s for _, scores in themes for s in scores if s.target is not None and s.value is not None]
    missed = [s for s in with_target if s.reached.startswith("missed")]
    lines = [f"**{len(with_target) - len(missed)} of {len(with_target)} targets are met.** Missed:", ""]
    lines += [f"* {s.name}: {s.text}, target {s.wanted}" for s in missed] or ["* none"]
    return [*lines, ""]


def _themes(themes: Sequence[tuple[str, Sequence[Score]]]) -> list[str]:
    lines = []
    for theme, scores in themes:
        lines += [f"## {theme}", "", "| score | measured | target | |", "|---|---|---|---|"]
        lines += [f"| {s.name} | {s.text} | {s.wanted} | {s.reached} |" for s in scores]
        lines += [""]
    return lines


def _sizes(rows: Sequence[Row], markdown: Path) -> list[str]:
    picture = markdown.with_name(f"{markdown.stem}_curves.png")
    draw_curves(rows, picture)
    lines = ["## Single effects by size", "", f"![share noticed and named against size]({picture.name})", ""]
    lines += ["| ENR | noticed | class | name | in top 3 |", "|---|---|---|---|---|"]
    return [*lines, *("| " + " | ".join(map(str, row)) + " |" for row in by_size(rows)), ""]


def _beside(rows: Sequence[Row], named: Mapping[str, Mapping[str, Any]], markdown: Path) -> list[str]:
    shared = [row for row in rows if named.get(row["case"])]
    methods = {"misfit diagnose": shared, **{name: as_rows(shared, named, name) for name in METHODS}}
    lines = ["## Beside other methods", "", _SAME.format(n=len(shared)), ""]
    lines += ["| method | " + " | ".join(COLUMNS) + " |", "|---" * (len(COLUMNS) + 1) + "|"]
    lines += [f"| {name} | " + " | ".join(method_scores(part)) + " |" for name, part in methods.items()]
    panels = {name: map_cells(part) for name, part in methods.items() if name != "random" and map_cells(part)}
    if panels:
        picture = markdown.with_name(f"{markdown.stem}_map.png")
        draw_map(panels, picture)
        lines += ["", "## Size of the effect and length of a trial", "", f"![right at class level]({picture.name})", ""]
        lines += ["Right at class level, `misfit diagnose`:", "", map_table(panels["misfit diagnose"])]
    return [*lines, ""]


def _confused(rows: Sequence[Row], markdown: Path) -> list[str]:
    found = answers(rows, 0.95 * ENOUGH)
    if not found:
        return []
    picture = markdown.with_name(f"{markdown.stem}_confusion.png")
    draw_confusion(found, picture)
    title = f"## What is taken for what (single effects from an ENR of {ENOUGH:g})"
    return [title, "", f"![answers by truth]({picture.name})", "", *confusion_table(found), ""]


def _kinds(rows: Sequence[Row]) -> list[str]:
    lines = []
    for title, key in (("machine", "model"), ("noise of the sensors", "noise")):
        head = (title, "false alarms", "single: class", "single: name", "pair: class", "outside: found")
        lines += [f"## By {title}", "", "| " + " | ".join(head) + " |", "|---" * len(head) + "|"]
        lines += ["| " + " | ".join(map(str, row)) + " |" for row in by_kind(rows, key)] + [""]
    return lines


def _whole(rows: Sequence[Row]) -> str:
    """What other sizes would need."""
    hours = {size: needed_hours(rows, suite(size)) for size in ("small", "medium", "full")}
    parts = [f"{size} ({len(suite(size))} cases) {h:.1f}" for size, h in hours.items() if h is not None]
    return f"Processor hours that whole sizes would need by these figures: {', '.join(parts) or 'not known'}."


def _failures(done: Sequence[Done]) -> list[str]:
    failed = [case.row for case in done if case.row is not None and case.row["failed"]]
    unmade = [case for case in done if case.row is None and case.why != TIME_IS_UP]
    lines = []
    if failed:
        lines += ["## Runs that failed", "", *(f"* {r['case']}: {_last(r['failed'])}" for r in failed), ""]
    if unmade:
        lines += ["## Cases that the truth simulator could not make (in no score)", ""]
        lines += [f"* {case.name}: {_last(case.why)}" for case in unmade]
    return lines


def _last(text: str) -> str:
    return text.strip().splitlines()[-1][:200]
