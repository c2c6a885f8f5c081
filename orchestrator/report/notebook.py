"""Results in a notebook: what `_repr_html_` and `plot` of results show, made of the same parts as the reports."""

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from fmus.errors import MisfitError
from orchestrator.compare.result import Comparison
from orchestrator.ledger import LedgerEntry, newest
from orchestrator.measurements.wording import nearest
from orchestrator.report import figures
from orchestrator.report.answer import answer_of
from orchestrator.report.answer.markup import answer_html
from orchestrator.report.arm_drawing import Line, Panel, Replay
from orchestrator.report.arm_drawing.curves import curves_svg
from orchestrator.report.html import render_part
from orchestrator.report.page import Page, PageTable, Picture, Section, effects_table, set_errors_table, versions_table
from orchestrator.report.palette import Colour
from orchestrator.report.pictures import falling, moving, step_versions
from orchestrator.report.sentences import comparison_sentence
from orchestrator.report.summary import comparison_facts, comparison_plain
from orchestrator.shown import Shown, register
from orchestrator.verdicts.result import Diagnosis

if TYPE_CHECKING:
    from orchestrator.gp.block import Block
    from orchestrator.results.result import Result

MOST_PANELS = 6
MOST_COLUMNS = 40


def register_drawings() -> None:
    """Say what draws each kind of result."""
    register("comparison", comparison_html, comparison_plot)
    register("diagnosis", diagnosis_html, diagnosis_plot)
    register("ledger", ledger_html, ledger_plot)
    register("result", result_html, result_plot)
    register("block", block_html, block_plot)
    register("replay", replay_html_of, lambda found: Shown(replay_html_of(found)))


def comparison_html(found: Comparison) -> str:
    """The verdict, large numbers, and the errors of both sets."""
    section = Section("Results", tables=(set_errors_table(found),))
    verdict, plain, facts = comparison_sentence(found), comparison_plain(found), comparison_facts(found)
    return render_part(Page("", verdict, None, (section,), plain, facts))


def comparison_plot(found: Comparison, trial: str | None = None) -> Shown:
    """Curves of a trial with their residuals; of the first one worth a figure if none is named.

    Raises:
        MisfitError: if there is no such trial.
    """
    names = [curves.file for curves in found.curves]
    if not names or trial not in (None, *names):
        hint = nearest(str(trial), names) if names else "it keeps no curves"
        raise MisfitError(f"the comparison has no curves of {trial or 'any trial'}; {hint}")
    curves = figures.shown_trials(found)[0] if trial is None else found.curves[names.index(trial)]
    return _picture(figures.trial_curves(found, curves), f"Measured and modelled curves of {curves.file}.")


def diagnosis_html(found: Diagnosis) -> str:
    """The first screen of the answer; effects with intervals and what the data leave open are folded below it."""
    sections = (
        Section("What is missing", tables=effects_table(found.effects)),
        Section("What the data leave open", found.warnings),
    )
    document = found.to_json()
    return render_part(Page("", "", None, sections, answer=answer_html(answer_of(document), document)))


def diagnosis_plot(found: Diagnosis) -> Shown:
    """The error that falls from step to step; the ranking where no effect was added."""
    picture = falling(step_versions(found))
    if picture is not None:
        return _shown(picture)
    return _picture(figures.ranking(found), "What was tried, best first.")


def ledger_html(entries: Sequence[LedgerEntry]) -> str:
    """The versions of a model, with the error that falls."""
    section = Section("Versions", tables=(versions_table(entries),) if entries else ())
    return render_part(Page("", "", _falling_of(entries), (section,)))


def ledger_plot(entries: Sequence[LedgerEntry]) -> Shown:
    """The error of each version.

    Raises:
        MisfitError: if there are fewer than two versions.
    """
    picture = _falling_of(entries)
    if picture is None:
        raise MisfitError("an error falls from one version to the next; the ledger has fewer than two")
    return _shown(picture)


def result_html(found: "Result") -> str:
    """What a run recorded: range and end of each column, and the first curves."""
    texts = (f"The run ended early: {found.failure}",) if found.failure else ()
    if len(found.time) < 2:
        return render_part(Page("", "", None, (Section("", (*texts, f"{len(found.time)} rows were recorded.")),)))
    numeric = [column for column in found.columns if _is_number(found, column.name)]
    rows = tuple((column.name, column.unit, *_range(found[column.name])) for column in numeric[:MOST_COLUMNS])
    left = len(numeric) - MOST_COLUMNS
    caption = f"{len(found.time)} rows over {found.time[0]:g} to {found.time[-1]:g} s"
    caption += f"; {left} more columns" if left > 0 else ""
    table = PageTable(caption, ("column", "unit", "first", "least", "largest", "last"), rows)
    pictures = (Picture(_curves(found, ()), ""),) if rows else ()
    return render_part(Page("", "", None, (Section("", texts, tables=(table,), pictures=pictures),)))


def result_plot(found: "Result", names: Sequence[str] = ()) -> Shown:
    """Curves of columns over time, one panel each; of the first few without names.

    Raises:
        MisfitError: if there is no such column, or nothing was recorded.
    """
    if len(found.time) < 2:
        raise MisfitError("the result has fewer than two rows, so there is nothing to draw")
    return Shown(render_part(Page("", "", None, (Section("", pictures=(Picture(_curves(found, names), ""),)),))))


def forces_plot(
    time: np.ndarray, names: Sequence[str], units: Sequence[str], mean: np.ndarray, std: np.ndarray
) -> Shown:
    """A missing force over time, (n,) s, one panel for each column of `mean` and `std` (n, k); std is NaN where unknown.

    Args:
        time: in s.
        names: signals that the forces act on.
        units: of the forces.
        mean: (n, k).
        std: (n, k).
    """
    panels = [
        Panel(f"missing on {name}", unit, (Line(name, Colour.IMPROVED, mean[:, k], _known(std[:, k])),))
        for k, (name, unit) in enumerate(zip(names, units, strict=True))
    ]
    picture = Picture(curves_svg(time, panels), "Missing force with 90 % band; zero would be nothing missing.")
    return _shown(picture)


def _known(std: np.ndarray) -> np.ndarray | None:
    return std if np.isfinite(std).all() else None


def block_html(found: "Block") -> str:
    """What a learned block takes and gives, and its curves."""
    rows = [(name, unit, "input") for name, unit in found.inputs.items()]
    rows += [(name, "", "factor") for name in found.factors]
    rows += [(output.name, output.unit, "output") for output in found.outputs]
    count = len(found.posterior.rows.inputs)
    table = PageTable(f"Learned from {count} data", ("name", "unit", "what"), tuple(rows))
    return render_part(Page("", "", None, (Section("", tables=(table,), pictures=(_slices(found),)),)))


def block_plot(found: "Block") -> Shown:
    """Mean and 90 % band of each output over each input."""
    return _shown(_slices(found))


def replay_html_of(found: Replay) -> str:
    """A replay that moves in a trusted notebook."""
    return render_part(Page("", "", None, (), replay=moving(found)))


def _slices(found: "Block") -> Picture:
    caption = "Mean with 90 % band; ticks are data; inputs that an axis does not show stand at their median."
    return Picture(figures.block_slices(found), caption)


def _curves(found: "Result", names: Sequence[str]) -> str:
    numeric = [column.name for column in found.columns if _is_number(found, column.name)]
    chosen = [found.column(name) for name in names or numeric[:MOST_PANELS]]
    panels = [
        Panel(c.name, c.unit, (Line(c.name, Colour.IMPROVED, np.asarray(found[c.name], dtype=float)),)) for c in chosen
    ]
    return curves_svg(np.asarray(found.time), panels)


def _is_number(found: "Result", name: str) -> bool:
    return np.asarray(found[name]).dtype.kind in "fiub"


def _range(values: np.ndarray) -> tuple[str, str, str, str]:
    numbers = np.asarray(values, dtype=float)
    first, least, largest, last = (f"{x:.4g}" for x in (numbers[0], numbers.min(), numbers.max(), numbers[-1]))
    return first, least, largest, last


def _falling_of(entries: Sequence[LedgerEntry]) -> Picture | None:
    return falling([(entry.name, entry.learning, entry.held_out) for entry in newest(entries)])


def _picture(image: str, caption: str) -> Shown:
    return _shown(Picture(image, caption))


def _shown(picture: Picture) -> Shown:
    return Shown(render_part(Page("", "", None, (Section("", pictures=(picture,)),))))
