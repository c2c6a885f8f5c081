"""The picture of a law: the missing force with its 90 % band, the law through it, and where it is extrapolated."""

import io

import numpy as np

from orchestrator.greybox.expression import evaluate_numbers
from orchestrator.laws.proposal import LawProposal
from orchestrator.report.figures._canvas import axis_label, canvas
from orchestrator.report.palette import Colour

# The law is drawn this share of the range beyond what was seen.
BEYOND = 0.25


def picture_of(proposal: LawProposal) -> bytes:
    """An SVG image; nothing where the record shows no curve."""
    curve = proposal.curve
    if curve is None:
        return b""
    x, force, band, law = (np.array(part) for part in (curve.x, curve.force, curve.band, curve.law))
    figure, axes = canvas(1, 1, 3.4)
    ax = axes[0, 0]
    ax.fill_between(
        x, force - band, force + band, color=Colour.RESIDUAL, alpha=0.35, linewidth=0, label="missing force, 90 %"
    )
    ax.plot(x, law, color=Colour.MODEL, linewidth=1.6, label="law")
    low, high = proposal.seen.get(curve.coordinate, (float(x.min()), float(x.max())))
    beyond = _beyond(proposal, low, high)
    for place, values in beyond:
        ax.plot(place, values, color=Colour.MODEL, linewidth=1.2, linestyle=":")
        ax.axvspan(place[0], place[-1], color="0.9", zorder=0)
    if beyond:
        ax.plot([], [], color=Colour.MODEL, linestyle=":", label="extrapolated")
    ax.set_xlabel(axis_label(curve.coordinate, curve.coordinate_unit), fontsize=9)
    ax.set_ylabel(axis_label(f"force at {proposal.site}", proposal.unit), fontsize=9)
    ax.set_title(proposal.sentence[:100], fontsize=9)
    ax.legend(fontsize=8, frameon=False)
    stream = io.BytesIO()
    figure.savefig(stream, format="svg", metadata={"Date": None})
    return stream.getvalue()


def _beyond(proposal: LawProposal, low: float, high: float) -> list[tuple[np.ndarray, np.ndarray]]:
    """The law outside of what was seen, on both sides, if it depends on one variable without memory."""
    if len(proposal.coordinates) != 1 or proposal.law.states or "time" in proposal.coordinates:
        return []
    (name,) = proposal.law.seen
    values = {key: estimate.value for key, estimate in proposal.parameters.items()}
    reach = BEYOND * (high - low)
    sides = (np.linspace(low - reach, low, 30), np.linspace(high, high + reach, 30))
    found = []
    for side in sides:
        force = np.asarray(evaluate_numbers(proposal.law.expression, {**values, name: side}), dtype=float)
        found.append((side, np.broadcast_to(force, side.shape)))
    return found
