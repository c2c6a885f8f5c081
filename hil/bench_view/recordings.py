"""A recording of a robot as a project of the studio: its measurement set, with a model beside it."""

import json
import shutil
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path

from fmus.errors import MisfitError
from hil.recording.identify import CLASS, MODEL, write_identification
from hil.recording.recorder import FRAMES
from hil.session.recorded import SETTINGS, SUMMARY, recorded_pilot
from orchestrator.measurements import load_measurements
from orchestrator.studio.project import Project
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
