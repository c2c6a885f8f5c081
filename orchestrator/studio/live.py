"""Parts of a page that follow what is on disk, whoever changed it: this tab, another one, or a job."""

from collections.abc import Callable, Hashable
from typing import Protocol

from nicegui import ui

from fmus.errors import MisfitError
from orchestrator.studio.text import paragraph


class Part(Protocol):
    """A part of a page."""

    def check(self) -> None:
        """Look whether what it shows has changed, and follow."""
        ...


class Live:
    """A part that is drawn again when its stamp has changed, and only then."""

    def __init__(self, stamp: Callable[[], Hashable], build: Callable[[], None]) -> None:
        self._stamp, self._build = stamp, build
        self._box = ui.element("div").classes("studio-part")
        self._seen: Hashable = object()
        self.check()

    def check(self) -> None:
        """Look, and draw if needed."""
        stamp = self._stamp()
        if stamp == self._seen:
            return
        self._seen = stamp
        self._box.clear()
        with self._box:
            try:
                self._build()
            except MisfitError as error:
                paragraph(str(error), "studio-problem")
