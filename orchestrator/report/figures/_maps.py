"""What is known over one or two coordinates: maps of an error, a latent force with its band, a learned block."""

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from orchestrator.report.figures._canvas import axis_label, canvas, image
from orchestrator.report.numbers import quantity
from orchestrator.report.palette import Colour
from orchestrator.verdicts.latent_force import LatentForce

if TYPE_CHECKING:
    from orchestrator.gp.block import Block, Output


POINTS = 80
_Z90 = 1.645


def block_slices(block: "Block") -> str:
    """Return an image of the mean of each output with its 90 % band; ticks below the curves are data.

    Factors of terms, such as activations, are 1.
    """
    seen = block.posterior.rows.inputs
    middle, low, high = np.median(seen, axis=0), seen.min(axis=0), seen.max(axis=0)
    figure, axes = canvas(len(block.outputs), len(block.inputs), 2.6 * len(block.outputs), sharey="row")
    said = []
    for row, output in enumerate(block.outputs):
        largest = 0.0
        for column, (name, unit) in enumerate(block.inputs.items()):
            ax, points = axes[row, column], np.tile(middle, (POINTS, 1))
            points[:, column] = np.linspace(low[column], high[column], POINTS)
            mean, std = _along(block, output, points)
            at, largest = points[:, column], max(largest, float(np.abs(mean).max()))
            band = (mean - _Z90 * std, mean + _Z90 * std)
            ax.fill_between(at, *band, color=Colour.IMPROVED, alpha=0.2, linewidth=0)
            ax.plot(at, mean, color=Colour.IMPROVED, linewidth=1.6)
            ax.plot(
                seen[:, column], np.full(len(seen), 0.02), "|", color=Colour.OTHER, transform=ax.get_xaxis_transform()
            )
            ax.axhline(0.0, color=Colour.INK, linewidth=0.6)
            ax.set_xlabel(axis_label(name, unit), fontsize=9)
        axes[row, 0].set_ylabel(axis_label(output.name, output.unit), fontsize=9)
        said.append(f"{output.name} up to {quantity(largest, output.unit)}")
    return image(figure, f"Learned outputs over each input, the others at the median of the data: {'; '.join(said)}.")


def _along(block: "Block", output: "Output", points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Mean and standard deviation (n,) at points (n, d)."""
    coefficients = block.coefficients(output, dict.fromkeys((*block.inputs, *block.factors), 1.0))
    mean = block.posterior.mean(coefficients, points)[:, output.component]
    return mean, np.sqrt(block.posterior.variance(coefficients, points))


def latent_curve(curve: LatentForce) -> str:
    """Return an image of a force that no effect explains: with its 90 % band (left), over both coordinates (right)."""
    figure, axes = canvas(1, 2, 3.2)
    left, right = axes[0]
    first, second = (
        axis_label(name, unit) for name, unit in zip(curve.coordinates, curve.coordinate_units, strict=True)
    )
    left.fill_between(
        curve.at, curve.low, curve.high, color=Colour.RESIDUAL, alpha=0.35, linewidth=0, label="90 % band"
    )
    left.plot(curve.at, curve.force, color=Colour.RESIDUAL, linewidth=1.6, label="curve")
    left.axhline(0.0, color=Colour.INK, linewidth=0.6)
    left.set_xlabel(first, fontsize=9)
    left.set_ylabel(axis_label(f"left of {curve.signal}", curve.unit), fontsize=9)
    left.legend(fontsize=8, frameon=False)
    lines = right.contour(curve.surface_at, curve.at, curve.surface, levels=8, colors=Colour.RESIDUAL, linewidths=1.0)
    right.clabel(lines, fontsize=7, fmt="%.2g")
    right.set_xlabel(second, fontsize=9)
    right.set_ylabel(first, fontsize=9)
    return image(figure, curve.sentence())


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
