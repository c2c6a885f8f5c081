"""A signal with its reference as an inline image."""

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from orchestrator.regress.comparison import SignalVerdict
from orchestrator.regress.outcome import Curve
from orchestrator.report.figures._canvas import axis_label, canvas, image, label, plain_log_axis
from orchestrator.report.palette import Colour

if TYPE_CHECKING:
    from matplotlib.axes import Axes

# More lines in one picture cannot be told apart, and errors above this only hide the others.
_MOST_LINES, _HIGHEST = 8, 1e6


def curve_figure(curve: Curve, verdict: SignalVerdict | None) -> str:
    """Reference and result over time, and below the stretch around the worst place, which a mark shows."""
    worst = None if verdict is None else verdict.worst_time
    zoomed = worst is not None and np.isfinite(worst) and len(curve.time) > 2
    figure, axes = canvas(2 if zoomed else 1, 1, 4.4 if zoomed else 2.6)
    for ax in axes[:, 0]:
        if curve.reference is not None and curve.reference_time is not None:
            ax.plot(
                curve.reference_time,
                curve.reference,
                color=Colour.MEASURED,
                linewidth=1.8,
                alpha=0.55,
                label="reference",
            )
        ax.plot(curve.time, curve.values, color=Colour.MODEL, linewidth=1.2, linestyle="--", label="result")
        ax.set_ylabel(axis_label(curve.name, curve.unit), fontsize=9)
        if worst is not None and np.isfinite(worst):
            ax.axvline(worst, color=Colour.MODEL, linewidth=0.8, alpha=0.6)
    axes[-1, 0].set_xlabel("time (s)", fontsize=9)
    axes[0, 0].legend(fontsize=8, frameon=False)
    if zoomed and worst is not None:
        _zoom(axes[1, 0], curve, worst)
    words = "" if verdict is None else f", {verdict.reason}"
    return image(figure, f"{label(curve.name)} over time{words}")


def _zoom(ax: "Axes", curve: Curve, worst: float) -> None:
    """A twentieth of the run around the worst place."""
    width = 0.025 * float(curve.time[-1] - curve.time[0])
    parts = [curve.values[np.abs(curve.time - worst) <= width]]
    if curve.reference is not None and curve.reference_time is not None:
        parts.append(curve.reference[np.abs(curve.reference_time - worst) <= width])
    seen = np.concatenate(parts)
    ax.set_xlim(worst - width, worst + width)
    if seen.size:
        spare = 0.1 * float(np.ptp(seen)) or 1e-9
        ax.set_ylim(float(seen.min()) - spare, float(seen.max()) + spare)


def trend_figure(case: str, lines: Sequence[tuple[str, Sequence[float | None]]]) -> str:
    """Worst error over tolerance of each signal, run by run; the line at 1 is the limit."""
    figure, axes = canvas(1, 1, 2.6)
    ax = axes[0, 0]
    for name, values in lines[:_MOST_LINES]:
        heights = np.array([np.nan if value is None else min(value, _HIGHEST) for value in values], dtype=float)
        ax.plot(np.arange(1, len(heights) + 1), np.maximum(heights, 1e-6), marker="o", markersize=3, label=label(name))
    ax.axhline(1.0, color=Colour.FLOOR, linewidth=0.8, linestyle=":")
    plain_log_axis(ax, "y")
    ax.xaxis.get_major_locator().set_params(integer=True)
    ax.set_xlabel("run", fontsize=9)
    ax.set_ylabel("worst error / tolerance", fontsize=9)
    ax.legend(fontsize=8, frameon=False)
    return image(figure, f"Worst error over tolerance of {len(lines)} signals of {label(case)} by run")
