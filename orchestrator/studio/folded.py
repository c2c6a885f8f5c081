"""A part of a page behind one line, which opens and closes by itself when the work has gone on, and by a click."""

from collections.abc import Callable
from types import TracebackType
from typing import Self

from nicegui import ui


class Folded:
    """`words` gives the line ("" hides the part), `opened` whether it is open; a click holds until `opened` changes."""

    def __init__(self, id: str, words: Callable[[], str], opened: Callable[[], bool]) -> None:
        self._words, self._opened = words, opened
        self._seen: bool | None = None
        self._box = ui.element("details").classes("studio-folded").props(f"id={id}")
        with self._box:
            with ui.element("summary"):
                self._line = ui.label("")
            self._inside = ui.element("div")
        self.check()

    def check(self) -> None:
        """Follow the disk."""
        words = self._words()
        self._line.set_text(words)
        self._box.set_visibility(bool(words))
        opened = self._opened()
        if opened == self._seen:
            return
        self._seen = opened
        if opened:
            self._box.props("open")
        else:
            self._box.props(remove="open")
        script = f"const box = document.getElementById('{self._box.props['id']}'); if (box) box.open = {str(opened).lower()};"
        ui.run_javascript(script)

    def __enter__(self) -> Self:
        self._inside.__enter__()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._inside.__exit__(kind, error, trace)
