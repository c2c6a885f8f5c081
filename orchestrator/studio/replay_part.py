"""The arm in motion along the worst trial, where the model is an arm."""

from nicegui import ui

from orchestrator.studio.live import Live
from orchestrator.studio.project import REPLAY, Project, file_stamp
from orchestrator.studio.text import heading, paragraph


def replay_part(project: Project) -> Live:
    """Add the part."""
    return Live(lambda: file_stamp(project.folder / "results" / REPLAY), lambda: _build(project))


def _build(project: Project) -> None:
    found = project.result(REPLAY)
    if found is None:
        return
    heading("The arm in motion, as given")
    # Made by a job of this project from numbers; nothing of it is a user's text.
    box = ui.html(found["markup"], sanitize=False)
    paragraph(found["caption"], "studio-hint")
    ui.timer(0.05, lambda: _mount(box), once=True)


def _mount(box: ui.html) -> None:
    ui.run_javascript(f"document.querySelectorAll('#{box.html_id} .arm-replay').forEach(misfitArm.mount)")
