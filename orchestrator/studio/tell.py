"""Errors of clicks, told in one line where the user looks."""

from collections.abc import Iterator
from contextlib import contextmanager

from nicegui import ui

from fmus.errors import MisfitError


@contextmanager
def telling() -> Iterator[None]:
    """Show a MisfitError of the body as a message that stays until it is closed."""
    try:
        yield
    except MisfitError as error:
        ui.notify(" ".join(str(error).split()), type="negative", timeout=0, close_button="Close", multi_line=True)
