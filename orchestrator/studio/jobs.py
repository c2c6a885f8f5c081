"""Long work in a process group of its own; all that is known about it is on disk."""

import json
import os
import shutil
import signal
import subprocess
import time
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from fmus.children import child_environment, python_command, start_child
from fmus.errors import MisfitError
from fmus.files import lock as take_lock
from fmus.files import try_lock, write_atomically
from orchestrator.elapsed import Elapsed
from orchestrator.studio.project import Project

State = Literal["none", "running", "done", "failed", "cancelled"]
PATIENCE_S = 5.0
PROGRAM = tuple(python_command("orchestrator.studio.child"))
_children: list["subprocess.Popen[bytes]"] = []


@dataclass(frozen=True)
class Job:
    """The present or last job of a project: its kind, state, newest message, seconds since it began, and how far it has gone."""

    kind: str
    state: State
    message: str
    seconds: float
    gone: str = ""

    @property
    def running(self) -> bool:
        """Whether it still works."""
        return self.state == "running"


def start(project: Project, kind: str, arguments: Sequence[str] = ()) -> None:
    """Begin a job.

    The child holds a lock on `job/lock` for as long as it or a descendant of it lives: whoever looks at the project
    later, another tab or another server, can tell whether it runs, which a process number alone cannot.

    Raises:
        MisfitError: if the project has one that runs.
    """
    folder = project.folder / "job"
    if _locked(folder):
        raise MisfitError("another job of this project is running; wait for it or cancel it")
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir()
    with (folder / "lock").open("w") as lock, (folder / "log.txt").open("wb") as log:
        take_lock(lock)
        child = start_child(
            [*PROGRAM, kind, *arguments],
            environment=child_environment(),
            cwd=project.folder,
            stdin=subprocess.DEVNULL,
            stdout=log,
            stderr=log,
            pass_fds=[lock.fileno()],
        )
    _children.append(child)
    begun = {"kind": kind, "process": child.pid, "begun": time.time()}
    write_atomically(folder / "begun.json", json.dumps(begun).encode())


def look(project: Project) -> Job:
    """The project's present or last job."""
    _reap()
    folder = project.folder / "job"
    begun = _read(folder / "begun.json")
    if not begun:
        return Job("", "none", "", 0.0)
    kind, seconds = str(begun["kind"]), time.time() - float(str(begun["begun"]))
    if _locked(folder):
        return Job(kind, "running", *_progress(folder / "progress.txt", time.time() - seconds, seconds))
    end = _read(folder / "end.json")
    if not end:
        return Job(kind, "failed", "the work ended without a result; perhaps memory ran out: start it again", seconds)
    state: State = "done" if end["state"] == "done" else "cancelled" if end["state"] == "cancelled" else "failed"
    return Job(kind, state, str(end["message"]), float(str(end["seconds"])))


def cancel(project: Project, why: str = "cancelled") -> None:
    """End a job with all processes that it started; on return none of them runs."""
    folder = project.folder / "job"
    begun = _read(folder / "begun.json")
    if not begun or not _locked(folder):
        return
    for number in (signal.SIGTERM, signal.SIGKILL):
        _kill(int(str(begun["process"])), number)
        if _ended(folder, PATIENCE_S):
            break
    if not (folder / "end.json").exists():
        seconds = time.time() - float(str(begun["begun"]))
        end = {"state": "cancelled", "message": why, "seconds": seconds}
        write_atomically(folder / "end.json", json.dumps(end).encode())


def cancel_all() -> None:
    """End the jobs of this server, which is about to end; a diagnosis that is started again goes on where it was."""
    for child in _children:
        if child.poll() is None:
            _kill(child.pid, signal.SIGTERM)
    for child in _children:
        try:
            child.wait(PATIENCE_S)
        except subprocess.TimeoutExpired:
            _kill(child.pid, signal.SIGKILL)


def _kill(group: int, number: signal.Signals) -> None:
    try:
        os.killpg(group, number)
    except ProcessLookupError:
        return


def _ended(folder: Path, patience: float) -> bool:
    deadline = time.monotonic() + patience
    while _locked(folder) and time.monotonic() < deadline:
        _reap()
        time.sleep(0.02)
    return not _locked(folder)


def _locked(folder: Path) -> bool:
    try:
        with (folder / "lock").open("r") as lock:
            return not try_lock(lock)
    except FileNotFoundError:
        return False


def _reap() -> None:
    """Let ended children of this server go."""
    _children[:] = [child for child in _children if child.poll() is None]


def _read(path: Path) -> dict[str, object]:
    try:
        return dict(json.loads(path.read_text()))
    except (OSError, ValueError):
        return {}


def _progress(path: Path, began: float, seconds: float) -> tuple[str, float, str]:
    """The newest message, the seconds since the beginning, and how far the work has gone."""
    now = began
    gone = Elapsed(lambda: now)
    message = "starting"
    try:
        lines = path.read_text().splitlines()
    except OSError:
        lines = []
    for line in lines:
        at, _, rest = line.partition(" ")
        message = rest or line
        with suppress(ValueError):  # a line that is being written
            now = float(at)
        gone.said(message)
    now = began + seconds
    return message, seconds, gone.words
