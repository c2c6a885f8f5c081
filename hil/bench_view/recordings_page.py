"""The page of recordings: a click makes a project of one, and compares and diagnoses are clicks there."""

import json
import shutil
from collections.abc import Awaitable, Callable
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path

from nicegui import run, ui

from fmus.errors import MisfitError
from hil.bench_view.page import SESSIONS
from hil.recording.identify import CLASS, MODEL, write_identification
from hil.recording.recorder import FRAMES
from hil.session.recorded import SETTINGS, SUMMARY, recorded_pilot
from orchestrator.measurements import load_measurements
from orchestrator.studio import workspace
from orchestrator.studio.pages import Page
from orchestrator.studio.project import Project
from orchestrator.studio.text import heading, paragraph, telling
from orchestrator.studio.workspace import Workspace

# What `hil.trials` says of the emulated arm's joints in a set of trials, and the model that it belongs to.
ARM = "arm"


@dataclass(frozen=True)
class Recording:
    """A recording by its folder."""

    folder: Path

    @property
    def words(self) -> str:
        """When it was made, and what became of the session."""
        at = datetime.fromtimestamp((self.folder / FRAMES).stat().st_mtime, UTC).isoformat(sep=" ", timespec="minutes")
        try:
            found = json.loads((self.folder / SUMMARY).read_text())
            cycles, faults = int(found["cycles"]), list(found["faults"])
        except (OSError, ValueError, KeyError, TypeError):
            return f"{at[:16]} UTC, not finished: misfit hil finish {self.folder}"
        return f"{at[:16]} UTC, {cycles} cycles, {faults[0] if faults else 'no faults'}"


def recordings(*roots: Path) -> list[Recording]:
    """Those in these folders, and in folders right below them, the newest first."""
    found = {path.parent.resolve() for root in roots for path in (*root.glob(FRAMES), *root.glob(f"*/{FRAMES}"))}
    whole = [folder for folder in found if (folder / SETTINGS).exists()]
    return [Recording(folder) for folder in sorted(whole, key=lambda folder: -(folder / FRAMES).stat().st_mtime)]


def make_project(home: Workspace, folder: Path, joint: int | None = None) -> Project:
    """A new project: trials of the emulated arm with its model, or one joint of another session with a model of inertia alone.

    Args:
        folder: of the recording.
        joint: its number; the one that moved most without it. Trials have no such choice.

    Raises:
        MisfitError: if the recording is none, or the arm was armed for too few cycles; no project is left then.
    """
    project = home.create(folder.name)
    try:
        if (folder / "case.toml").exists() and load_measurements(folder).frame == ARM:
            for file in [folder / "case.toml", *folder.glob("trial_*.parquet")]:
                shutil.copy(file, project.measurements)
            project.choose_model(ARM)
            return project
        write_identification(folder, recorded_pilot(folder), project.measurements, joint)
        (project.folder / "model").mkdir()
        (project.measurements / MODEL).rename(project.folder / "model" / MODEL)
        project.choose_model(f"model/{MODEL}:{CLASS}", (CLASS,))
    except MisfitError:
        home.remove(project)
        raise
    return project


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
