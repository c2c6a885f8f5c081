"""What a diagnosis costs, by machine."""

from collections.abc import Sequence
from statistics import median
from typing import Any

from tests.benchmarks.diagnosis.truth.families import Wish


def cost_table(rows: Sequence[dict[str, Any]]) -> list[str]:
    """Markdown: seconds and memory of one diagnosis in one process, by machine."""
    lines = [
        "| machine | cases | processor s, median | processor s, most | wall s, median | wall s, most | peak MB, most |",
        "|---" * 7 + "|",
    ]
    for model in dict.fromkeys(row["model"] for row in rows):
        own = [row for row in rows if row["model"] == model and row["cpu_seconds"] is not None]
        if own:
            cpu, wall, peak = ([row[key] for row in own] for key in ("cpu_seconds", "wall_seconds", "peak_mb"))
            figures = (median(cpu), max(cpu), median(wall), max(wall), max(peak))
            lines.append(f"| {model} | {len(own)} | " + " | ".join(f"{x:.0f}" for x in figures) + " |")
    return lines


def needed_hours(rows: Sequence[dict[str, Any]], wishes: Sequence[Wish]) -> float | None:
    """Processor hours that diagnosing some cases would take, by what those of each machine took on average here.

    None if a machine has not been measured.
    """
    means = {}
    for machine in {wish.machine for wish in wishes}:
        own = [_spent(row) for row in rows if row["model"] == machine and row["cpu_seconds"] is not None]
        if not own:
            return None
        means[machine] = sum(own) / len(own)
    return sum(means[wish.machine] for wish in wishes) / 3600


def _spent(row: dict[str, Any]) -> float:
    return float(row["cpu_seconds"] + row["again_cpu_seconds"])
