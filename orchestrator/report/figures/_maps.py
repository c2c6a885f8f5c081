"""Maps of an error over what it may depend on."""

from collections.abc import Mapping, Sequence
from typing import Any

from orchestrator.report.figures._canvas import axis_label, canvas, image
from orchestrator.report.palette import Colour

MOST_MAPS = 4


def error_maps(name: str, rows: Sequence[Mapping[str, Any]]) -> str:
    """Return an image of one signal's error over the coordinates on which it depends most.

    `rows` are those of a comparison's "state": bins of a coordinate with rmse and bias.
    """
    groups: dict[str, list[Mapping[str, Any]]] = {}
    for row in rows:
        groups.setdefault(str(row["against"]), []).append(row)
    shown = sorted(groups.values(), key=lambda g: (g[0]["p_value"] > 0.05, -g[0]["strength"]))[:MOST_MAPS]
    figure, axes = canvas(1, len(shown), 2.7, sharey=True)
    for ax, group in zip(axes[0], shown, strict=True):
        edges = [group[0]["from"], *(row["to"] for row in group)]
        ax.stairs([row["rmse"] for row in group], edges, color=Colour.RESIDUAL, linewidth=1.6)
        middles = [0.5 * (row["from"] + row["to"]) for row in group]
        ax.plot(middles, [row["bias"] for row in group], color=Colour.RESIDUAL, linestyle=":", marker="o", markersize=3)
        ax.set_xlabel(axis_label(str(group[0]["against"]), str(group[0]["unit"])), fontsize=8)
    axes[0, 0].set_ylabel(f"{name}: rms (line), mean (dots)", fontsize=8)
    said = ", ".join(str(group[0]["against"]) for group in shown)
    return image(figure, f"Error of {name} by what it depends on most: {said}.")
