"""What is being done, shown in a notebook and on a terminal; nothing in a pipe."""

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from html import escape
from importlib import import_module
from typing import Any

from orchestrator.elapsed import Elapsed, columns

Say = Callable[[str], None]


@contextmanager
def progress(show: bool = True) -> Iterator[Say]:
    """A function that replaces the line on display; the line goes when the work is done."""
    shell = _shell()
    if not show:
        yield lambda message: None
    elif shell is not None:
        yield from _in_notebook()
    elif sys.stderr.isatty():
        yield from _on_terminal()
    else:
        yield lambda message: None


def _shell() -> Any | None:
    """The kernel of a notebook, None elsewhere (a terminal's IPython has no kernel)."""
    shells = sys.modules.get("IPython")
    found = None if shells is None else shells.get_ipython()
    return found if getattr(found, "kernel", None) is not None else None


def _in_notebook() -> Iterator[Say]:
    notebook: Any = import_module("IPython.display")
    HTML, display = notebook.HTML, notebook.display

    def html(message: str) -> Any:
        return HTML(f'<span style="color:#666">{escape(message)}</span>')

    handle = display(html("starting"), display_id=True)
    try:
        yield lambda message: handle.update(html(message))
    finally:
        handle.update(HTML(""))


def _on_terminal() -> Iterator[Say]:
    from rich.console import Console
    from rich.progress import Progress

    gone = Elapsed()
    with Progress(*columns(gone), console=Console(stderr=True), transient=True) as bar:
        task = bar.add_task("starting")

        def say(message: str) -> None:
            gone.said(message)
            bar.update(task, description=message)

        yield say
