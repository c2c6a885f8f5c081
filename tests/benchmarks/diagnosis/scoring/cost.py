"""What a diagnosis costs, by machine."""

from collections.abc import Sequence
from statistics import median
from typing import Any


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
