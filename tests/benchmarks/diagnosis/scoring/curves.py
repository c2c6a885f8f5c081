"""How often a single effect is noticed and named against its size, and whether probabilities come true."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from tests.benchmarks.diagnosis.scoring.calibration import bins, reliability
from tests.benchmarks.diagnosis.scoring.paper import new_figure, save
from tests.benchmarks.diagnosis.scoring.summary import by_size
from tests.benchmarks.diagnosis.scoring.wilson import Share

_STYLES = (("noticed", "o", "-"), ("class", "s", "--"), ("name", "^", ":"), ("in top 3", "x", "-."))


def draw_curves(rows: Sequence[dict[str, Any]], path: Path) -> None:
    """Draw both with Wilson's 95 % intervals; lines differ by mark and stroke."""
    figure, ((power, trust),) = new_figure(1, 2, (9.0, 3.6))
    sizes = by_size(rows)
    for k, (label, mark, stroke) in enumerate(_STYLES):
        shares = [entry[1 + k] for entry in sizes]
        at = [i + 0.06 * (k - 1.5) for i in range(len(sizes))]
        _with_bars(power, at, shares, label=label, marker=mark, linestyle=stroke)
    power.set_xticks(range(len(sizes)), [f"{entry[0]}\nn = {entry[1].n}" for entry in sizes], fontsize=8)
    power.set(xlabel="effect / noise (ENR)", ylabel="share of single effects", ylim=(-0.02, 1.02))
    power.legend(fontsize=8)
    found = bins(reliability(rows))
    trust.plot([0, 1], [0, 1], color="0.6", linewidth=1)
    _with_bars(trust, [p for p, _ in found], [share for _, share in found], marker="o", linestyle="none")
    for p, share in found:
        trust.annotate(f"n = {share.n}", (p, share.value or 0), textcoords="offset points", xytext=(6, -10), fontsize=8)
    trust.set(xlabel="probability of the first in the ranking", ylabel="share that is the truth")
    trust.set(xlim=(-0.02, 1.02), ylim=(-0.02, 1.02))
    save(figure, path)


def _with_bars(axis: Any, at: Sequence[float], shares: Sequence[Share], **style: Any) -> None:
    values = [share.value or 0.0 for share in shares]
    below = [value - share.interval[0] for value, share in zip(values, shares, strict=True)]
    above = [share.interval[1] - value for value, share in zip(values, shares, strict=True)]
    axis.errorbar(at, values, yerr=[below, above], color="black", capsize=2, linewidth=1, markersize=4, **style)
