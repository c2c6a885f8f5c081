"""Pictures of the effect catalogue: what an effect changes, and the force that a model without it lacks."""

import io
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from docs.generator.signatures import Curve, Signature
from orchestrator.report.figures._canvas import axis_label, canvas, thinned
from orchestrator.report.palette import Colour

if TYPE_CHECKING:
    from matplotlib.axes import Axes


@dataclass(frozen=True)
class Picture:
    """A PNG and what it shows in words."""

    png: bytes
    alt: str


def picture(signature: Signature) -> Picture:
    """Draw a signature: change of the output and missing force over time, and missing force over what shows it."""
    figure, axes = canvas(1, 3, 2.7)
    time, output = Curve("time", "s", signature.time), signature.with_effect
    change = Curve(f"change of {output.name}", output.unit, output.values - signature.without.values)
    _draw(axes[0, 0], time, change, Colour.IMPROVED, "-")
    time, missing, against = (_inner(curve) for curve in (time, signature.missing, signature.against))
    _draw(axes[0, 1], time, missing, Colour.RESIDUAL, "-")
    _draw(axes[0, 2], against, missing, Colour.RESIDUAL, "o")
    stream = io.BytesIO()
    figure.savefig(stream, format="png", metadata={"Software": None})
    return Picture(stream.getvalue(), _in_words(change, missing, against))


def _draw(ax: "Axes", x: Curve, y: Curve, colour: str, style: str) -> None:
    part = thinned(len(x.values), 1000)
    if style == "o":
        ax.plot(x.values[part], y.values[part], ".", color=colour, markersize=2.5)
    else:
        ax.plot(x.values[part], y.values[part], color=colour, linewidth=1.4)
    ax.set_xlabel(axis_label(x.name, x.unit), fontsize=8)
    ax.set_ylabel(axis_label(y.name, y.unit), fontsize=8)
    ax.locator_params(nbins=5)
    ax.ticklabel_format(useOffset=False, scilimits=(-3, 4))
    if np.ptp(y.values) < 1e-6 * max(np.abs(y.values).max(), 1e-6):  # a constant: its rounding is nothing to see
        middle = float(np.mean(y.values))
        low, high = sorted((-0.1 * middle, 1.5 * middle)) if abs(middle) > 1e-9 else (-1.0, 1.0)
        ax.set_ylim(low, high)


def _inner(curve: Curve) -> Curve:
    """Without the ends, where differences of samples are one-sided and lags have not settled."""
    n = len(curve.values)
    return replace(curve, values=curve.values[n // 50 : n - 5])


def _in_words(change: Curve, missing: Curve, against: Curve) -> str:
    """The largest values, for those who cannot see the curves."""
    at = float(against.values[np.argmax(np.abs(missing.values))])
    return (
        f"Three graphs. Over time the {change.name} reaches {_size(change)}; the {missing.name} goes from"
        f" {missing.values.min():.3g} to {missing.values.max():.3g} {missing.unit}. Against {against.name}, which goes from"
        f" {against.values.min():.3g} to {against.values.max():.3g} {_unit(against)}, it is largest at {at:.3g}."
    ).replace(" ,", ",")


def _size(curve: Curve) -> str:
    return f"{np.abs(curve.values).max():.3g} {_unit(curve)}".strip()


def _unit(curve: Curve) -> str:
    return "" if curve.unit == "1" else curve.unit
