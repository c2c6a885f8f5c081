"""Pages of the studio, found by entry points so that it need not know who brings one, and parts that follow the disk."""

from collections.abc import Callable, Hashable
from dataclasses import dataclass
from importlib.metadata import entry_points
from typing import Any, Protocol

from nicegui import ui

from fmus.errors import MisfitError
from orchestrator.studio.project import Project, file_stamp
from orchestrator.studio.text import paragraph

GROUP = "misfit.pages"


@dataclass(frozen=True)
class Page:
    """One page.

    `path` is its address, such as `/swap` or `/project/{project}`; `title` stands in the navigation and the browser's
    tab. `build` adds NiceGUI elements to the main part of the frame; it may be a coroutine function, and gets the
    parts of the address in braces as keyword arguments. Pages in the navigation are sorted by `order`; a page without
    one is reached by links only.
    """

    path: str
    title: str
    build: Callable[..., Any]
    order: int | None = None


def registered_pages() -> list[Page]:
    """Pages of all installed packages, in the order of the navigation.

    An entry point is `name = "module:register"`; `register()` returns a `Page` and is called once, before the server
    starts. It may also add routes to `nicegui.app`: the gate guards those, too.
    """
    pages: list[Page] = [entry.load()() for entry in entry_points(group=GROUP)]
    return sorted(pages, key=lambda page: (page.order is None, page.order, page.path))


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


def result_part(project: Project, file: str, build: Callable[[dict[str, Any]], None]) -> Live:
    """A part that draws a result of a project, and nothing while there is none."""

    def drawn() -> None:
        found = project.result(file)
        if found is not None:
            build(found)

    return Live(lambda: file_stamp(project.folder / "results" / file), drawn)
