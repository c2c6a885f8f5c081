"""The first page: what to work on."""

from nicegui import ui

from orchestrator.studio.pages import Page


def register() -> Page:
    """The start page."""
    return Page("/", "Projects", build, order=0)


def build() -> None:
    """What the studio does, and the projects."""
    ui.html("<h1>Where does your model fail, and what is missing?</h1>", sanitize=False)
