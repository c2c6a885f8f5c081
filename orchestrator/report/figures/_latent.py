"""The latent force: a curve with its band over the first coordinate, and contours over both."""

from orchestrator.report.figures._canvas import axis_label, canvas, image
from orchestrator.report.palette import Colour
from orchestrator.verdicts.latent_force import LatentForce


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
