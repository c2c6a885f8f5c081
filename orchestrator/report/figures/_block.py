"""A learned block: each output over each input, the other inputs at the middle of the data."""

from typing import TYPE_CHECKING

import numpy as np

from orchestrator.report.figures._canvas import axis_label, canvas, image
from orchestrator.report.numbers import quantity
from orchestrator.report.palette import Colour

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
