"""What was answered for which truth, as a table and as a matrix."""

from collections import Counter
from collections.abc import Sequence
from pathlib import Path
from typing import Any

_VERDICTS = ("adequate", "cannot_tell", "unknown", "several", "failed")


def answers(rows: Sequence[dict[str, Any]], least: float) -> dict[str, Counter[str]]:
    """Answers by truth: single effects from an ENR of `least` on, what is in no library, and nothing.

    An answer is the one effect that was named, `several`, or the verdict.
    """
    found: dict[str, Counter[str]] = {}
    for row in rows:
        truth = _truth(row, least)
        if truth is not None:
            said = row["said"]
            answer = said[0] if len(said) == 1 else "several" if said else row["verdict"]
            found.setdefault(truth, Counter())[answer] += 1
    return dict(sorted(found.items(), key=lambda entry: (entry[0].startswith("("), entry[0])))


def _truth(row: dict[str, Any], least: float) -> str | None:
    if row["family"] in ("N0", "N1", "N2"):
        return "(nothing)"
    if row["family"] == "O":
        return f"(outside: {row['kind']})"
    if row["family"] == "S" and row["enr"] >= least:
        return str(row["true"][0])
    return None


def confusion_table(found: dict[str, Counter[str]]) -> list[str]:
    """The same as markdown."""
    lines = ["| truth | answers | cases |", "|---|---|---|"]
    for truth, counts in found.items():
        said = ", ".join(f"{answer} {n}" for answer, n in counts.most_common())
        lines.append(f"| {truth} | {said} | {counts.total()} |")
    return lines


def draw_confusion(found: dict[str, Counter[str]], path: Path) -> None:
    """Draw the matrix; each cell has its count, so grey is enough."""
    from tests.benchmarks.diagnosis.scoring.paper import new_figure, save

    named = {answer for counts in found.values() for answer in counts} - set(_VERDICTS)
    columns = [*sorted(named | {t for t in found if not t.startswith("(")}), *_VERDICTS]
    figure, ((axis,),) = new_figure(1, 1, (2.5 + 0.32 * len(columns), 2.0 + 0.26 * len(found)))
    shares = [[counts[c] / counts.total() for c in columns] for counts in found.values()]
    axis.imshow(shares, cmap="Greys", vmin=0, vmax=1, aspect="auto")
    for i, (truth, counts) in enumerate(found.items()):
        for j, column in enumerate(columns):
            if counts[column]:
                colour = "white" if shares[i][j] > 0.5 else "black"
                weight = "bold" if column == truth else "normal"
                axis.text(j, i, counts[column], ha="center", va="center", color=colour, fontsize=7, weight=weight)
    axis.set_xticks(range(len(columns)), columns, rotation=90, fontsize=7)
    axis.set_yticks(range(len(found)), [f"{t}, {c.total()}" for t, c in found.items()], fontsize=7)
    axis.set(xlabel="answer", ylabel="truth, number of cases")
    save(figure, path)
