"""What was answered for which truth."""

from collections import Counter
from collections.abc import Sequence
from typing import Any


def confusion(rows: Sequence[dict[str, Any]]) -> list[tuple[str, str, int]]:
    """(truth, answers that were wrong with their counts, cases) of single effects and of what is in no library."""
    answers: dict[str, Counter[str]] = {}
    for row in rows:
        if row["family"] not in ("S", "O", "I"):
            continue
        truth = f"{row['kind']} (outside)" if row["kind"] else "+".join(row["true"])
        if row["family"] == "I":
            truth = "(no excitation)"
        said = "+".join(row["said"]) or row["verdict"]
        answers.setdefault(truth, Counter())[said] += 1
    return [
        (truth, ", ".join(f"{said} {n}" for said, n in counts.most_common()), sum(counts.values()))
        for truth, counts in sorted(answers.items())
    ]
