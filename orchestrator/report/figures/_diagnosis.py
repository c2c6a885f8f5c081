"""The evidence of a diagnosis: the ranking, and the error that falls from version to version."""

import math
from collections.abc import Sequence

from orchestrator.compare.result import SetErrors
from orchestrator.report.figures._canvas import canvas, image, label, plain_log_axis
from orchestrator.report.numbers import digits, percent
from orchestrator.report.palette import Colour
from orchestrator.report.sentences import ranked_name
from orchestrator.verdicts.result import Diagnosis

RANKING_BARS = 10

Version = tuple[str, SetErrors, SetErrors | None]


def ranking(diagnosis: Diagnosis) -> str:
    """Return an image of the best sets of effects as horizontal bars of the error they remove."""
    entries = diagnosis.ranking[:RANKING_BARS]
    figure, axes = canvas(1, 1, 0.8 + 0.32 * max(1, len(entries)))
    ax, places = axes[0, 0], range(len(entries))
    colours = [Colour.ACCENT if place == 0 else Colour.OTHER for place in places]
    shares = [100 * entry.score if math.isfinite(entry.score) else 0.0 for entry in entries]
    ax.barh(places, shares, color=colours, edgecolor=Colour.INK, linewidth=0.6, height=0.65)
    for place, (share, entry) in enumerate(zip(shares, entries, strict=True)):
        ax.text(max(0.0, share) + 1, place, percent(entry.score), va="center", fontsize=8)
    ax.set_yticks(places, [label(ranked_name(entry), 60) for entry in entries], fontsize=8)
    ax.set_xlim(min([0.0, *shares]), 130)
    ax.set_xticks(range(0, 101, 20))
    ax.set_xlabel("share of what is missing that a set explains (%)", fontsize=9)
    ax.invert_yaxis()
    best = "; ".join(f"{ranked_name(entry)} explains {percent(entry.score)}" for entry in entries[:3])
    return image(figure, f"Ranking of {len(diagnosis.ranking)} sets of effects: {best}.")


def falling_error(versions: Sequence[Version]) -> str:
    """Return an image of the error of each version as a multiple of the noise floor, on a log axis with the floor.

    `versions` are (name, errors on learning trials, errors on held-out trials or None), oldest first.
    """
    figure, axes = canvas(1, 1, 3.2)
    ax = axes[0, 0]
    learning = [_drawable(found.over_floor) for _, found, _ in versions]
    held_out = [math.nan if found is None else _drawable(found.over_floor) for _, _, found in versions]
    places = range(len(versions))
    ax.axhline(1.0, color=Colour.FLOOR, linestyle="--", linewidth=1.2, label="noise floor")
    ax.plot(
        places,
        learning,
        color=Colour.LEARNING,
        linestyle=":",
        marker="s",
        markersize=6,
        fillstyle="none",
        label="learning trials",
    )
    if not all(math.isnan(value) for value in held_out):
        ax.plot(
            places, held_out, color=Colour.HELD_OUT, linewidth=1.8, marker="o", markersize=7, label="held-out trials"
        )
    plain_log_axis(ax, "y")
    decisive = [(found or learned).over_floor for _, learned, found in versions]
    for place, value in zip(places, decisive, strict=True):
        if math.isfinite(value):
            ax.annotate(digits(value), (place, value), xytext=(8, 6), textcoords="offset points", fontsize=9)
    drawn = [value for value in (*learning, *held_out, 1.0) if math.isfinite(value)]
    ax.set_ylim(min(drawn) / 1.6, max(drawn) * 2)
    ax.set_xlim(-0.3, len(versions) - 0.4)
    ax.set_xticks(places, [label(name) for name, _, _ in versions], fontsize=9)
    ax.set_ylabel("error / noise floor", fontsize=9)
    ax.legend(fontsize=8, frameon=False, loc="upper right")
    steps = ", ".join(f"{name} {digits(value)}" for (name, _, _), value in zip(versions, decisive, strict=True))
    trials = "held-out" if versions[-1][2] is not None else "learning"
    return image(figure, f"Error on {trials} trials as a multiple of the noise floor, by model version: {steps}.")


def _drawable(value: float) -> float:
    """A log axis has no place for zero or for the infinite error of a model that diverged."""
    return value if math.isfinite(value) and value > 0 else math.nan
