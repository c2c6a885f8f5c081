"""What each column is: a small picture of it, its unit, its variable and how it runs between samples, by menus."""

import html
from typing import Any

from nicegui import run, ui
from nicegui.events import GenericEventArguments

from fmus.errors import MisfitError
from orchestrator.measurements.dirty.header_units import read_unit
from orchestrator.report.answer.words import capital
from orchestrator.report.numbers import digits
from orchestrator.studio.pages import Live, result_part
from orchestrator.studio.project import MATCH, Project
from orchestrator.studio.receive import make_way
from orchestrator.studio.text import bullets, details, heading, html_table, menu, paragraph, telling

HEADINGS = ("column", "data", "unit", "model variable", "unit in the model", "what becomes of it", "between samples")


def problem_part(project: Project) -> Live:
    """Add why the data cannot be used, and what to do, in the place of an answer."""
    return result_part(project, MATCH, _problem)


def _problem(found: dict[str, Any]) -> None:
    if not found["problem"]:
        return
    what, _, then = found["problem"].rpartition("; ")
    if found.get("own_case"):
        then = "choose variables and units in the table below"
    with ui.element("div").classes("answer"), ui.element("div").classes("a-verdict"):
        heading("These data cannot be used yet.")
        paragraph(f"{what or found['problem']}.", "studio-problem")
        ui.html(f'<p><span class="a-next">Next:</span> {html.escape(capital(then))}.</p>', sanitize=False)


def columns_part(project: Project) -> Live:
    """Add the part."""
    return result_part(project, MATCH, lambda found: _build(project, found))


def _build(project: Project, found: dict[str, Any]) -> None:
    heading("Columns and units")
    _table(project, found)
    trials = [[t["file"], t["set"], str(t["samples"]), f"{digits(t['seconds'])} s"] for t in found["trials"]]
    with details(f"{len(trials)} trials"):
        html_table("Trials", ("trial", "set", "samples", "length"), trials)
    if found["notes"]:
        with details("What was converted and assumed"):
            bullets(found["notes"])


def _table(project: Project, found: dict[str, Any]) -> None:
    own = bool(found.get("own_case"))
    name = "Columns of the measurements"
    box = ui.element("div").classes("view-scroll").props(f'role=region tabindex=0 aria-label="{name}"')
    with box, ui.element("table").classes("view-table studio-columns-table"):
        ui.html(name, tag="caption", sanitize=False)
        with ui.element("thead"), ui.element("tr"):
            for text in HEADINGS:
                ui.html(text, tag="th", sanitize=False).props("scope=col")
        with ui.element("tbody"):
            for place, row in enumerate(found["columns"]):
                _row(project, found, row, place, own)


def _row(project: Project, found: dict[str, Any], row: dict[str, Any], place: int, own: bool) -> None:
    column, variables = row["column"], found.get("variables", [])
    drives = row["variable"] in found.get("inputs", ())
    with ui.element("tr") as line:
        ui.html(html.escape(column), tag="th", sanitize=False).props("scope=row")
        ui.html(small_curve(row.get("curve", ())), tag="td", sanitize=False)
        with ui.element("td"):
            _unit(project, column, row["unit"], place) if own else _text(row["unit"])
        with ui.element("td"):
            options = {"": "none", **{name: name for name in variables}}
            if own and variables:
                _menu(project, column, "variables", options, row["variable"], f"variable-{place}", "Model variable")
            else:
                _text(row["variable"])
        ui.html(html.escape(row["model_unit"]), tag="td", sanitize=False)
        becomes = " · ".join(part for part in (row["role"], row["conversion"]) if part)
        ui.html(html.escape(becomes), tag="td", sanitize=False)
        with ui.element("td"):
            options = {"": "as the data say", "linear": "straight lines", "hold": "held"}
            how = row.get("interpolation", "")
            if own and drives:
                _menu(project, column, "interpolation", options, how, f"between-{place}", "Between samples")
            elif drives:
                _text(options[how])
    for cell, heading_text in zip(line.default_slot.children[1:], HEADINGS[1:], strict=True):
        cell.props["data-label"] = heading_text  # on a phone each cell says its column


def _text(text: str) -> None:
    ui.html(html.escape(text), tag="span", sanitize=False)


def _menu(project: Project, column: str, key: str, options: dict[str, str], chosen: str, id: str, label: str) -> None:
    async def choose(event: GenericEventArguments) -> None:
        with telling():
            await run.io_bound(make_way, project)
            project.wish(column, key, str(event.args))

    menu(id, f"{label} of {column}", options, chosen, choose, labelled=False)


def _unit(project: Project, column: str, unit: str, place: int) -> None:
    async def change(event: GenericEventArguments) -> None:
        with telling():
            found = read_unit(str(event.args))
            if found is None:
                raise MisfitError(
                    f"{event.args} is no unit that is known; use SI symbols such as N.m, rad/s or deg, or 1"
                )
            await run.io_bound(make_way, project)
            project.wish(column, "units", found)

    field = ui.element("input").props(f'id="unit-{place}" size=8').classes("studio-unit")
    field.props["aria-label"] = f"Unit of {column}"
    field.props["value"] = "" if unit == "not given" else unit
    field.props["placeholder"] = "not given"
    field.on("change", change, js_handler="(event) => emit(event.target.value)")


def small_curve(values: list[float] | tuple[float, ...]) -> str:
    """A curve without axes, as large as a word."""
    if len(values) < 2:
        return ""
    low, high = min(values), max(values)
    span = (high - low) or 1.0
    points = " ".join(
        f"{118 * place / (len(values) - 1) + 1:.1f},{23 - 20 * (value - low) / span:.1f}"
        for place, value in enumerate(values)
    )
    label = f"from {low:.4g} to {high:.4g}"
    return f'<svg class="studio-spark" role="img" aria-label="{label}" viewBox="0 0 120 26"><title>{label}</title><polyline points="{points}"/></svg>'
