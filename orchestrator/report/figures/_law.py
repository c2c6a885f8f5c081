"""A proposed law over the missing force."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from orchestrator.report.figures._canvas import axis_label, canvas, image
from orchestrator.report.palette import Colour


def law_curve(law: Mapping[str, Any]) -> str:
    """Return an image of the missing force with its 90 % band, and the law's means, over the coordinate that says most."""
    curve = law["curve"]
    x, force, band, fitted = (np.array(curve[key]) for key in ("x", "force", "band", "law"))
    figure, axes = canvas(1, 1, 3.0)
    ax = axes[0, 0]
    ax.fill_between(
        x, force - band, force + band, color=Colour.RESIDUAL, alpha=0.35, linewidth=0, label="missing, 90 %"
    )
    ax.plot(x, fitted, color=Colour.MODEL, linewidth=1.6, label="law")
    ax.set_xlabel(axis_label(curve["coordinate"], curve["coordinate_unit"]), fontsize=9)
    ax.set_ylabel(axis_label(f"force at {law['site']}", law["unit"]), fontsize=9)
    ax.legend(fontsize=8, frameon=False)
    return image(figure, f"{law['sentence']}: {law['formula']}")
