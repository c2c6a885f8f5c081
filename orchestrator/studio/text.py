"""Headings, paragraphs, lists, tables and menus as the elements that they are, with text from outside escaped."""

import html
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager

from nicegui import ui
from nicegui.events import GenericEventArguments

from fmus.errors import MisfitError
from orchestrator.report.page import PageTable
from orchestrator.studio.project import Project
from orchestrator.studio.receive import upload_limit
from orchestrator.studio.views.parts import table


def drop_zone(project: Project, kind: str, text: str, endings: str, *, multiple: bool, home: str = "project") -> None:
    """Add the zone and the line that tells what became of the files; `home` is the first part of the address that takes them."""
    status = f"sent-{kind}"
    with ui.element("div").classes("studio-drop"):
        with ui.element("label").props(f'for="choose-{kind}"'):
            ui.html(text, sanitize=False, tag="span")
        chooser = ui.element("input").props(f'type=file id="choose-{kind}" accept="{endings}"')
        chooser.props["data-upload"] = f"/{home}/{project.id}/upload/{kind}"
        chooser.props["data-status"] = status
        chooser.props["data-limit"] = upload_limit()
        if multiple:
            chooser.props["multiple"] = True
    ui.element("p").props(f'id="{status}" role=status').classes("studio-told")


@contextmanager
def telling() -> Iterator[None]:
    """Show a MisfitError of the body as a message that stays until it is closed."""
    try:
        yield
    except MisfitError as error:
        ui.notify(" ".join(str(error).split()), type="negative", timeout=0, close_button="Close", multi_line=True)


def heading(text: str, level: int = 2) -> None:
    """A heading."""
    ui.html(html.escape(text), tag=f"h{level}", sanitize=False)


def paragraph(text: str, kind: str = "") -> None:
    """A paragraph; `kind` is a class of studio.css."""
    ui.html(html.escape(text), tag="p", sanitize=False).classes(kind)


def bullets(texts: Iterable[str]) -> None:
    """A list, nothing for no texts."""
    items = "".join(f"<li>{html.escape(text)}</li>" for text in texts)
    if items:
        ui.html(items, tag="ul", sanitize=False).classes("studio-bullets")


def page_table(found: PageTable) -> None:
    """A table of a report."""
    html_table(found.caption, found.headings, found.rows)


def html_table(caption: str, headings: Sequence[str], rows: Sequence[Sequence[str]]) -> None:
    """A table that scrolls sideways where it is too wide."""
    box = ui.html(table(caption, headings, rows), sanitize=False).classes("view-scroll")
    for name, value in {"role": "region", "tabindex": "0", "aria-label": caption}.items():
        box.props[name] = value


def details(summary: str) -> ui.element:
    """A part that opens on a click; use it with `with`."""
    box = ui.element("details")
    with box, ui.element("summary"):
        ui.html(html.escape(summary), tag="span", sanitize=False)
    return box


def menu(
    id: str,
    label: str,
    options: Mapping[str, str],
    chosen: str,
    choose: Callable[[GenericEventArguments], object],
    *,
    closed: Collection[str] = (),
    labelled: bool = True,
) -> None:
    """A menu; `options` maps a value to what is shown, `closed` ones cannot be chosen. In a table the label is heard only."""
    if labelled:
        with ui.element("label").props(f'for="{id}"'):
            ui.html(html.escape(label), sanitize=False, tag="span")
    select = ui.element("select").props(f'id="{id}"').classes("studio-select")
    if not labelled:
        select.props["aria-label"] = label
    select.on("change", choose, js_handler="(event) => emit(event.target.value)")
    with select:
        for value, text in options.items():
            option = ui.element("option")
            option.props["value"] = value
            option.props["selected"] = value == chosen
            if value in closed:
                option.props["disabled"] = True
            with option:
                ui.html(html.escape(text), tag="span", sanitize=False)
