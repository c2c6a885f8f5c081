"""What all views share: a heading, a sentence that says what the picture shows, and the same as a table."""

import html
from collections.abc import Awaitable, Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path

from nicegui import background_tasks, ui

from orchestrator.report.palette import css_variables

STYLE = Path(__file__).with_name("views.css")


def use_style() -> None:
    """Bring the style of the views to the present page."""
    ui.add_css(css_variables() + STYLE.read_text())


@contextmanager
def section(heading: str) -> Iterator[None]:
    """A part of the page under a heading of third order."""
    with ui.element("section") as part:
        label(part, heading)
        ui.html(f"<h3>{html.escape(heading)}</h3>", sanitize=False)
        yield


def label(element: ui.element, name: str, **attributes: str) -> None:
    """Give an element its accessible name, and other attributes."""
    for attribute, value in {"aria-label": name, **attributes}.items():
        element.props[attribute] = value


def picture_frame(kind: str) -> ui.element:
    """A box of fixed height, `kind` being a class of views.css: pictures come after the page and must not move it."""
    return ui.element("div").classes(f"view-frame {kind}")


class Words:
    """The sentence below a picture, announced when it changes, and the table behind it."""

    def __init__(self, title: str) -> None:
        self._title = title
        self.sentence = ui.element("p").props("aria-live=polite").classes("view-fixed")
        with self.sentence:
            self._text = ui.html("", sanitize=False, tag="span")
        with ui.element("details").classes("view-details"):
            with ui.element("summary"):
                ui.html(f"{html.escape(title)} as a table", sanitize=False, tag="span")
            self._table = ui.html("", sanitize=False).classes("view-scroll")
            label(self._table, f"Table: {title}", role="region", tabindex="0")

    def describe(self, picture: ui.element, name: str, role: str = "img") -> None:
        """Give a picture its accessible name and this sentence."""
        label(picture, name, role=role)
        picture.props["aria-describedby"] = self.sentence.html_id

    def say(self, sentence: str, columns: Sequence[str], rows: Sequence[Sequence[str]]) -> None:
        """Show a sentence and a table."""
        self._text.set_content(html.escape(sentence))
        self._table.set_content(table(self._title, columns, rows))


def table(caption: str, columns: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    """A table as HTML; the first column names the rows, and on a phone each cell says its column."""
    head = "".join(f'<th scope="col">{html.escape(name)}</th>' for name in columns)
    body = "".join(
        f'<tr><th scope="row">{html.escape(row[0])}</th>{"".join(map(_cell, columns[1:], row[1:]))}</tr>'
        for row in rows
    )
    return f'<table class="view-table"><caption>{html.escape(caption)}</caption><thead><tr>{head}</tr></thead><tbody>{body}</tbody></table>'


def _cell(column: str, text: str) -> str:
    return f'<td data-label="{html.escape(column)}">{html.escape(text)}</td>'


def legend(marks: Mapping[str, str]) -> str:
    """What the colours of a picture stand for, as HTML."""
    entries = "".join(f'<li><span style="background: {colour}"></span>{name}</li>' for name, colour in marks.items())
    return f'<ul class="view-legend">{entries}</ul>'


class Latest:
    """Runs the last of several calls that come while an earlier one is at work, and forgets those between."""

    def __init__(self, work: Callable[[], Awaitable[None]]) -> None:
        self._work = work
        self._running = self._again = False

    def __call__(self, *_: object) -> None:
        self._again = True
        if not self._running:
            self._running = True
            background_tasks.create(self._run(), name="view")

    async def _run(self) -> None:
        try:
            while self._again:
                self._again = False
                await self._work()
        finally:
            self._running = False
