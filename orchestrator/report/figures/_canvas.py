"""What all figures share: a canvas, and the way into a page as an inline image."""

import base64
import html
import io
import unicodedata
import warnings
from collections.abc import Sequence
from typing import TYPE_CHECKING, Literal

import numpy as np

from orchestrator.report.palette import SERIES

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

DPI = 110
WIDTH = 9.0  # inches
MAX_POINTS = 2000
MAX_SIGNALS = 3


def canvas(
    rows: int,
    columns: int,
    height: float,
    *,
    sharex: bool = False,
    sharey: bool | Literal["row"] = False,
    height_ratios: Sequence[float] | None = None,
) -> tuple["Figure", np.ndarray]:
    """Return a figure of page width, `height` inches high, and its axes, shape (rows, columns)."""
    # pyplot would keep every figure alive and choose a window system; matplotlib is slow to import.
    from matplotlib.figure import Figure

    figure = Figure(figsize=(WIDTH, height), dpi=DPI, layout="tight")
    axes = figure.subplots(rows, columns, squeeze=False, sharex=sharex, sharey=sharey, height_ratios=height_ratios)
    lines = {"color": SERIES * 2, "linestyle": ["-"] * len(SERIES) + ["--"] * len(SERIES)}
    for ax in axes.flat:
        ax.set_prop_cycle(**lines)
        ax.spines[["top", "right"]].set_visible(False)
        ax.tick_params(labelsize=8)
        ax.set_axisbelow(True)
        ax.grid(alpha=0.25, linewidth=0.5)
    return figure, axes


def image(figure: "Figure", alt: str) -> str:
    """Return a figure as an `<img>` element whose PNG is inside it; `alt` says what it shows, with numbers."""
    stream = io.BytesIO()
    with warnings.catch_warnings():
        # A file name may hold characters that the font lacks; a box in their place is good enough.
        warnings.filterwarnings("ignore", message="Glyph")
        figure.savefig(stream, format="png", metadata={"Software": None})
    data = base64.b64encode(stream.getvalue()).decode("ascii")
    width, height = (round(inches * DPI) for inches in figure.get_size_inches())
    source = f"data:image/png;base64,{data}"
    return f'<img src="{source}" width="{width}" height="{height}" alt="{html.escape(alt)}">'


def label(text: str, longest: int = 40) -> str:
    """Return a user's text fit for a figure: one line, not too long, and `$` without its mathematical meaning."""
    line = "".join(" " if unicodedata.category(c)[0] == "C" else c for c in text)
    if len(line) > longest:
        line = line[: longest // 2] + "…" + line[-longest // 2 :]
    return line.replace("$", r"\$")


def axis_label(name: str, unit: str) -> str:
    """Return a quantity with its unit in brackets, or alone when it has none."""
    return f"{label(name)} ({label(unit)})" if unit not in ("", "1") else label(name)


def thinned(count: int, most: int = MAX_POINTS) -> slice:
    """Return the slice that keeps at most `most` of `count` samples, evenly."""
    return slice(None, None, max(1, -(-count // most)))


def plain_log_axis(ax: "Axes", which: str) -> None:
    """Give the x or y axis a log scale with plain numbers, as mathematical text is slow and needs its own fonts."""
    from matplotlib.ticker import FuncFormatter, NullFormatter

    getattr(ax, f"set_{which}scale")("log")
    axis = getattr(ax, f"{which}axis")
    axis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    axis.set_minor_formatter(NullFormatter())
