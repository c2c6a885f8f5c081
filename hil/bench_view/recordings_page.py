"""The page of recordings: a click makes a project of one, and compares and diagnoses are clicks there."""

from collections.abc import Awaitable, Callable
from pathlib import Path

from nicegui import run, ui

from hil.bench_view.page import SESSIONS
from hil.bench_view.recordings import Recording, make_project, recordings
from orchestrator.studio import workspace
from orchestrator.studio.pages import Page
from orchestrator.studio.tell import telling
from orchestrator.studio.text import heading, paragraph

PATH = "/recordings"
# Where sessions record if nobody says otherwise.
USUAL = Path("recordings")
MOST = 0


def register() -> Page:
    """The page of recordings."""
    return Page(PATH, "Recordings", build, order=45)


def build() -> None:
    """What was recorded on this machine, each with a button."""
    heading("Recordings", 1)
    paragraph(
        "Sessions with a robot that were recorded on this machine. A project takes one joint of a session with a model that has inertia and"
        " nothing else, or the trials of an emulated arm with the arm's model. What the model lacks is named there."
    )
    SESSIONS.find()
    folders = [each.folder for each in SESSIONS.all() if each.is_over and each.folder is not None]
    found = recordings(USUAL, *folders)
    if not found:
        paragraph(
            f"There are none in {USUAL.resolve()}. Record one in a terminal: misfit hil identify system.toml --out DIR"
        )
    options = {MOST: "the joint that moved most", **{k: f"joint {k}" for k in (1, 2, 3)}}
    for each in found:
        name = each.folder.name
        with ui.element("section").classes("studio-card") as card:
            card.props["aria-label"] = name
            heading(name, 3)
            paragraph(each.words)
            joint = ui.select(options, value=MOST, label="Joint")
            button = ui.button("Make a project", on_click=_maker(each, joint)).props("no-caps outline")
            button.props["aria-label"] = f"Make a project of {name}"


def _maker(recording: Recording, joint: ui.select) -> Callable[[], Awaitable[None]]:
    async def make() -> None:
        with telling():
            chosen = None if joint.value == MOST else int(joint.value)
            project = await run.io_bound(make_project, workspace.current(), recording.folder, chosen)
            if project is not None:  # the server ends
                ui.navigate.to(f"/project/{project.id}")

    return make
