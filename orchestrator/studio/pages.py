"""Pages of the studio, found by entry points, so that the studio need not know who brings one."""

from collections.abc import Callable
from dataclasses import dataclass
from importlib.metadata import entry_points
from typing import Any

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
