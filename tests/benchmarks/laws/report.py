"""The tables of docs/benchmarks/laws.md from results: `python -m tests.benchmarks.laws.report RESULTS.jsonl ...`."""

import json
import sys
from pathlib import Path
from typing import Any

from tests.benchmarks.diagnosis.scoring.wilson import Share
from tests.benchmarks.laws.run import RIGHT

HELD_OUT = 1.5


def rows_of(files: list[str]) -> list[dict[str, Any]]:
    """All results, by case."""
    lines = [line for file in files for line in Path(file).read_text().splitlines()]
    return sorted((json.loads(line) for line in lines), key=lambda row: str(row["case"]))


def summary(rows: list[dict[str, Any]]) -> str:
    """Shares over cases with an effect, and proposals in cases without."""
    hidden = [row for row in rows if not row["case"].endswith("nothing")]
    nulls = [row for row in rows if row["case"].endswith("nothing")]
    seconds = sorted(row.get("processor_seconds", row["seconds"]) for row in rows)

    # Where what the library names explains the held-out trial, no formula is asked for.
    told = [row for row in hidden if not row["proposed"] and row["library_ratio"] <= HELD_OUT]

    def share(count: int) -> str:
        return str(Share(count, len(hidden)))

    lines = [
        ("cases with a hidden effect", str(len(hidden))),
        ("a law was proposed", share(sum(bool(r["proposed"]) for r in hidden))),
        ("no formula, since what the library names explains the held-out trial", share(len(told))),
        (
            "functionally right (force within 5 %)",
            share(sum(r["off"] is not None and r["off"] <= RIGHT for r in hidden)),
        ),
        ("in its simplest form", share(sum(r["simplest"] for r in hidden))),
        ("held-out error <= 1.5 x the noise", share(sum((r["held_out_ratio"] or 9e9) <= HELD_OUT for r in hidden))),
        (
            "held-out error <= 1.5 x the noise, by a law or by the library",
            share(len(told) + sum((r["held_out_ratio"] or 9e9) <= HELD_OUT for r in hidden)),
        ),
        ("made worse", share(sum(r["worse"] for r in hidden))),
        ("proposals where nothing is hidden", f"{sum(bool(r['proposed']) for r in nulls)} of {len(nulls)}"),
        (
            "seconds of the processor, median and most",
            f"{seconds[len(seconds) // 2]:.0f}, {seconds[-1]:.0f}" if seconds else "",
        ),
    ]
    return "\n".join(["| measure | |", "|---|---|", *(f"| {name} | {value} |" for name, value in lines)])


def details(rows: list[dict[str, Any]]) -> str:
    """A row for each case."""
    head = "| case | library's answer | formula | off | held-out error over noise: as given, with what the library names -> with the law |\n|---|---|---|---|---|"
    found = []
    for r in rows:
        off = "" if r["off"] is None or r["off"] != r["off"] else f"{r['off']:.1%}"
        after = "" if r["held_out_ratio"] is None else f" -> {r['held_out_ratio']:.3g}"
        formula = f"`{r['proposed']}`" if r["proposed"] else "none"
        beside = f" beside {', '.join(r['beside'])}" if r["beside"] else ""
        named = ", ".join(r["named"])
        found.append(f"| {r['case']} | {r['verdict']}{': ' + named if named else ''} | {formula}{beside} | {off} | {r['before_ratio']:.3g}, {r['library_ratio']:.3g}{after} |")  # fmt: skip
    return "\n".join([head, *found])


if __name__ == "__main__":
    results = rows_of(sys.argv[1:])
    print(summary(results) + "\n\n" + details(results))
