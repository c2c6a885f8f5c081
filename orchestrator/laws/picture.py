"""The picture of a law: the missing force with its 90 % band, the law through it, and where it is extrapolated."""

import io

import numpy as np

from orchestrator.greybox.expression import evaluate_numbers
from orchestrator.laws.proposal import LawProposal
from orchestrator.report.figures._canvas import axis_label, canvas
from orchestrator.report.palette import Colour

# So much of the range that was seen is shown beyond it, on both sides.
BEYOND = 0.25
POINTS = 200


def picture_of(proposal: LawProposal) -> bytes:
    """An SVG image; nothing where the record shows no curve."""
    curve = proposal.curve
    if curve is None:
        return b""
    x, force, band, law = (np.array(part) for part in (curve.x, curve.force, curve.band, curve.law))
    low, high = proposal.seen.get(curve.coordinate, (float(x.min()), float(x.max())))
    reach = BEYOND * (high - low)
    figure, axes = canvas(1, 1, 3.4)
    ax = axes[0, 0]
    ax.fill_between(
        x, force - band, force + band, color=Colour.RESIDUAL, alpha=0.35, linewidth=0, label="missing force, 90 %"
    )
    if _depends_on_one(proposal, curve.coordinate):
        x = np.linspace(low, high, POINTS)
        law = _law(proposal, x)
        for side in ((low - reach, low), (high, high + reach)):
            place = np.linspace(*side, POINTS)
            ax.plot(place, _law(proposal, place), color=Colour.MODEL, linewidth=1.2, linestyle=":")
    ax.plot(x, law, color=Colour.MODEL, linewidth=1.6, label="law")
    if curve.coordinate in proposal.seen:
        for ends in ((low - reach, low), (high, high + reach))[curve.coordinate == "time" :]:
            ax.axvspan(*ends, color="0.9", zorder=0)
        ax.fill_between([], [], color="0.9", label="not seen, extrapolated")
    ax.set_xlabel(axis_label(curve.coordinate, curve.coordinate_unit), fontsize=9)
    ax.set_ylabel(axis_label(f"force at {proposal.site}", proposal.unit), fontsize=9)
    ax.set_title(proposal.sentence[:100], fontsize=9)
    ax.legend(fontsize=8, framealpha=0.9, edgecolor="none")
    stream = io.BytesIO()
    figure.savefig(stream, format="svg", metadata={"Date": None})
    return stream.getvalue()


def _depends_on_one(proposal: LawProposal, coordinate: str) -> bool:
    """Whether what is drawn is a function of one coordinate, so that it can be drawn as one, further than it was seen."""
    law = proposal.law
    return list(proposal.coordinates) == [coordinate] and not (law.states or proposal.beside or "net" in law.asks_for)


def _law(proposal: LawProposal, x: np.ndarray) -> np.ndarray:
    (name,) = proposal.law.seen
    values = {key: estimate.value for key, estimate in proposal.parameters.items()}
    with np.errstate(all="ignore"):  # it may be undefined where nothing was seen
        return np.broadcast_to(np.asarray(evaluate_numbers(proposal.law.expression, {**values, name: x})), x.shape)
