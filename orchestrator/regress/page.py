"""Outcomes as one HTML file that needs no network and no script, with a picture of each signal that failed."""

from collections.abc import Sequence
from datetime import UTC, datetime
from importlib.metadata import version
from typing import TYPE_CHECKING

import numpy as np

from fmus.units import after_number
from orchestrator.regress.comparison import SignalVerdict
from orchestrator.regress.outcome import Curve, Outcome
from orchestrator.report.figures._canvas import axis_label, canvas, image, label, plain_log_axis
from orchestrator.report.html import render
from orchestrator.report.numbers import quantity
from orchestrator.report.page import Page, PageTable, Picture, Section
from orchestrator.report.palette import Colour
from orchestrator.report.summary import Fact

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


# A page with more pictures takes longer to draw than the cases to run.
_MOST_PICTURES = 40


def page(outcomes: Sequence[Outcome]) -> str:
    """The page: what failed first, with pictures; then every case, and every comparison."""
    wrong = [each for each in outcomes if each.verdict != "passed"]
    verdict = (
        f"{len(outcomes)} cases, all passed" if not wrong else f"{len(wrong)} of {len(outcomes)} cases did not pass"
    )
    left = _MOST_PICTURES
    sections = []
    for outcome in wrong:
        shown = outcome.curves[:left]
        left -= len(shown)
        sections.append(_failed(outcome, shown))
    sections += [
        Section("All cases", tables=(_cases(outcomes),)),
        Section("All comparisons", tables=_comparisons(outcomes)),
    ]
    made = (("misfit", version("misfit-fmu")), ("made", datetime.now(UTC).strftime("%Y-%m-%d %H:%M:%S UTC")))
    models = ((each.name, f"sha256 {each.model_sha256}") for each in outcomes if each.model_sha256)
    sections.append(Section("Provenance", pairs=(*made, *models)))
    return render(Page("Regression tests", verdict, None, tuple(sections), facts=_facts(outcomes)))


def _facts(outcomes: Sequence[Outcome]) -> tuple[Fact, ...]:
    """How many of each verdict, and how long it took."""
    counts = {verdict: sum(each.verdict == verdict for each in outcomes) for verdict in ("passed", "failed", "error")}
    took = quantity(sum(each.took_s for each in outcomes), "s")
    return (
        Fact("Passed", str(counts["passed"]), f"of {len(outcomes)} cases", "good" if counts["passed"] else ""),
        Fact("Failed", str(counts["failed"]), "differ from what was expected", "bad" if counts["failed"] else ""),
        Fact(
            "Not run", str(counts["error"]), "a component or the case itself failed", "bad" if counts["error"] else ""
        ),
        Fact("Time", took, "of the clock, over all cases"),
    )


def _failed(outcome: Outcome, shown: Sequence[object]) -> Section:
    verdicts = {each.name: each for each in outcome.signals if not each.passed}
    texts = [outcome.reason, *(f"{each.check}: {each.reason}" for each in outcome.wholes if not each.passed)]
    pictures = [
        Picture(curve_figure(curve, verdicts.get(curve.name)), f"{curve.name}: {_reason(verdicts.get(curve.name))}")
        for curve in outcome.curves[: len(shown)]
    ]
    pairs = (("file", outcome.file), *((("compared with", outcome.where),) if outcome.where else ()))
    tables = _comparisons([outcome])
    return Section(
        f"{outcome.name}: {outcome.verdict}", tuple(dict.fromkeys(texts)), pairs, tables, tuple(pictures), True
    )


def _reason(verdict: SignalVerdict | None) -> str:
    return "" if verdict is None else verdict.reason


def _cases(outcomes: Sequence[Outcome]) -> PageTable:
    rows = tuple((each.name, each.verdict, f"{each.took_s:.2g} s", each.file, each.reason) for each in outcomes)
    return PageTable("Cases", ("case", "verdict", "time", "file", "why"), rows)


def _comparisons(outcomes: Sequence[Outcome]) -> tuple[PageTable, ...]:
    rows = []
    for outcome in outcomes:
        for each in outcome.signals:
            passing = "" if each.would_have_passed is None else f"{each.would_have_passed:.4g}{after_number(each.unit)}"
            verdict = "passed" if each.passed else "failed"
            rows.append((outcome.name, each.name, each.check, verdict, each.tolerance, passing, each.reason))
        for whole in outcome.wholes:
            rows.append((outcome.name, "", whole.check, "passed" if whole.passed else "failed", "", "", whole.reason))
    headings = ("case", "signal", "check", "verdict", "tolerance", "would have passed", "what was found")
    return (PageTable("Comparisons", headings, tuple(rows)),) if rows else ()
