"""Headings, paragraphs, lists and tables as the elements that they are, with text from outside escaped."""

import html
from collections.abc import Iterable, Sequence

from nicegui import ui

from orchestrator.report.page import PageTable
from orchestrator.studio.views.parts import table


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
