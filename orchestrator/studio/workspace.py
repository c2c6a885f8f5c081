"""The folder with all projects."""

import re
import secrets
import shutil
from datetime import UTC, datetime
from pathlib import Path

from fmus.errors import MisfitError
from orchestrator.studio.project import Project

_ID = re.compile(r"[a-z0-9]{10}")
_ALPHABET = "abcdefghijkmnpqrstuvwxyz23456789"


class Workspace:
    """Projects, each in a folder that is named by its id; everything about them is on disk and nowhere else."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder / "projects"
        self.folder.mkdir(parents=True, exist_ok=True)

    def create(self, name: str) -> Project:
        """A new, empty project."""
        project = Project(self.folder / "".join(secrets.choice(_ALPHABET) for _ in range(10)))
        project.change(name=name, created=datetime.now(UTC).isoformat(timespec="seconds"))
        return project

    def project(self, id: str) -> Project:
        """The project with an id.

        Raises:
            MisfitError: if there is none.
        """
        project = Project(self.folder / id)
        if not _ID.fullmatch(id) or not project.exists:
            raise MisfitError("there is no such project; choose one on the start page")
        return project

    def projects(self) -> list[Project]:
        """All projects, the newest first."""
        found = [Project(each) for each in self.folder.iterdir() if _ID.fullmatch(each.name)]
        return sorted((each for each in found if each.exists), key=lambda each: each.created, reverse=True)

    def remove(self, project: Project) -> None:
        """Delete a project for good; at once for everybody who looks, even if its files take a while."""
        bin = self.folder / f"removed-{project.id}"
        project.folder.rename(bin)
        shutil.rmtree(bin, ignore_errors=True)


_current: list[Workspace] = []


def use(folder: Path) -> Workspace:
    """Open the workspace of this server."""
    _current[:] = [Workspace(folder)]
    return _current[0]


def current() -> Workspace:
    """The workspace of this server."""
    return _current[0]
