"""The swap view: two FMUs side by side, what differs in their interfaces, where their trajectories part, how fast each runs."""

import re
import secrets
import shutil
from collections.abc import Callable
from functools import partial
from pathlib import Path

from fastapi import Request
from fastapi.responses import PlainTextResponse, Response
from nicegui import app, run, ui

from fmus.errors import MisfitError
from orchestrator.studio import jobs, workspace
from orchestrator.studio.names import safe_name
from orchestrator.studio.pages import Live, Page
from orchestrator.studio.project import Project, file_stamp
from orchestrator.studio.receive import checked, keep
from orchestrator.studio.swap_drive import CHOICES, RECORDED
from orchestrator.studio.swap_result import swap_result, verdict
from orchestrator.studio.swap_task import DEFAULT_TOLERANCE, RECORDING, RESULT, SIDES, file_of
from orchestrator.studio.text import drop_zone, heading, paragraph, telling

EVERY_S = 0.5
ENDINGS = (".csv", ".parquet", ".h5", ".mf4")
# Comparisons are cheap to repeat; the oldest make room.
MOST_KEPT = 20
_ID = re.compile(r"[a-z0-9]{10}")
_TITLES = {"old": "The FMU that is there", "new": "The one to take its place"}


def register() -> Page:
    """The page in the navigation: a new comparison."""

    @app.put("/swap/{id}/upload/{side}")
    async def upload(id: str, side: str, name: str, request: Request) -> Response:
        try:
            project = _opened(id)
            if side not in (*SIDES, RECORDING):
                raise MisfitError(f"an FMU is {' or '.join(SIDES)}, not {safe_name(side)!r}")
            return PlainTextResponse(await keep(project, name, request.stream(), _taker(side)))
        except MisfitError as error:
            return PlainTextResponse(" ".join(str(error).split()), 400)

    return Page("/swap", "Swap", build, order=20)


def register_one() -> Page:
    """The page of one comparison, which a reload shows again."""
    return Page("/swap/{swap}", "Swap", build)


def build(swap: str = "") -> None:
    """Two places for FMUs, what to run, and what was found."""
    new = not swap
    id = swap or secrets.token_hex(5)
    if not _ID.fullmatch(id):
        heading("No such comparison", 1)
        ui.link("Begin a new one", "/swap")
        return
    if new:
        ui.run_javascript(f"history.replaceState(null, '', '/swap/{id}')")
    project = Project(_folder() / id)
    heading("Two FMUs side by side", 1)
    paragraph("Drop in two versions or makes of a model. You see which variables differ and when they begin to part.")
    parts: list[Live] = []
    with ui.element("section").classes("studio-columns").props('aria-label="The two FMUs"'):
        for side in SIDES:
            with ui.element("div"):
                heading(_TITLES[side])
                parts.append(Live(partial(_name, project, side), partial(_named, project, side)))
                drop_zone(project, side, "Drop an FMU here, or choose one:", ".fmu", multiple=False, home="swap")
    with ui.element("section").props('aria-label="A recording"'):
        drop_zone(
            project,
            RECORDING,
            "A recording that moves them, if there is one:",
            ",".join(ENDINGS),
            multiple=False,
            home="swap",
        )
    work = _Work(project)
    parts.append(Live(lambda: file_stamp(project.results / RESULT) if project.exists else None, _shower(project)))

    if new:
        _earlier(id)

    def follow() -> None:
        work.check()
        for part in parts:
            part.check()

    ui.timer(EVERY_S, follow)


class _Work:
    """How long to run, what drives the inputs, Compare and Cancel, and what is being done."""

    def __init__(self, project: Project) -> None:
        self.project = project
        settings = project.settings if project.exists else {}
        with ui.element("section").classes("studio-bar").props('aria-label="Run both"'):
            with ui.element("div").classes("studio-buttons"):
                self.stop = ui.number("Run until (s)", value=settings.get("stop"), min=0).props("dense clearable")
                tolerance = settings.get("tolerance") or DEFAULT_TOLERANCE
                self.tolerance = ui.number("Equal within this share of the range", value=tolerance, min=0, step=1e-4)
                self.tolerance.props("dense").style("width: 19rem")
                names = list(CHOICES)
                self.drive = ui.select(names, label="Inputs", value=settings.get("drive", names[0])).props("dense")
                self.drive.style("width: 20rem")
                self.compare = ui.button("Compare", on_click=self._compare).props("no-caps unelevated")
                self.cancel = ui.button("Cancel", on_click=self._cancel).props("no-caps outline color=negative")
            self.state = ui.label().classes("studio-state").props("role=status")
        self.check()

    def _compare(self) -> None:
        with telling():
            self.project.change(stop=self.stop.value, tolerance=self.tolerance.value, drive=self.drive.value)
            jobs.start(self.project, "swap")
        self.check()

    async def _cancel(self) -> None:
        await run.io_bound(jobs.cancel, self.project)

    def check(self) -> None:
        """Follow the disk; begin by itself once both FMUs are there."""
        project = self.project
        if not project.exists or None in [file_of(project, side) for side in SIDES]:
            self.compare.disable()
            self.cancel.disable()
            self.state.set_text("Next: drop in both FMUs.")
            return
        job = jobs.look(project)
        if job.state == "none":
            with telling():
                jobs.start(project, "swap")
                job = jobs.look(project)
        self.compare.set_enabled(not job.running)
        self.cancel.set_enabled(job.running)
        words = {
            "running": f"Comparing · {job.seconds:.0f} s · {job.message}",
            "done": f"Compared in {job.seconds:.0f} s.",
            "failed": f"Comparing failed: {job.message}",
            "cancelled": f"Comparing: {job.message} after {job.seconds:.0f} s.",
        }
        self.state.set_text(words.get(job.state, ""))


def _earlier(own: str) -> None:
    """Comparisons that were made before, the newest first."""
    folder = _folder()
    known = sorted(folder.iterdir(), key=lambda each: each.stat().st_mtime, reverse=True) if folder.is_dir() else []
    found = [(each.name, result) for each in known if each.name != own and (result := Project(each).result(RESULT))]
    if not found:
        return
    heading("Earlier comparisons")
    with ui.element("ul").classes("studio-files"):
        for id, result in found:
            with ui.element("li"):
                ui.link(" and ".join(result["files"]), f"/swap/{id}")
                ui.label(verdict(result)).classes("studio-hint")


def _shower(project: Project) -> Callable[[], None]:
    def show() -> None:
        found = project.result(RESULT)
        if found is not None:
            swap_result(found)

    return show


def _name(project: Project, side: str) -> str:
    file = file_of(project, side) if project.exists else None
    return file.name if file else ""


def _named(project: Project, side: str) -> None:
    paragraph(_name(project, side) or "None yet.")


def _folder() -> Path:
    return workspace.current().folder.parent / "swaps"


def _opened(id: str) -> Project:
    """The comparison with an id that a page has given; it comes into being with its first file."""
    if not _ID.fullmatch(id):
        raise MisfitError("there is no such comparison; begin a new one")
    project = Project(_folder() / id)
    if not project.exists:
        project.folder.mkdir(parents=True, exist_ok=True)
        _make_room()
        project.change(name="swap")
    return project


def _make_room() -> None:
    """Remove the oldest comparisons that nothing works on."""
    known = sorted(_folder().iterdir(), key=lambda each: each.stat().st_mtime, reverse=True)
    for folder in known[MOST_KEPT:]:
        if not jobs.look(Project(folder)).running:
            shutil.rmtree(folder, ignore_errors=True)


def _taker(side: str) -> Callable[[Project, str, Path], str]:
    def take(project: Project, name: str, file: Path) -> str:
        if side == RECORDING:
            return _recording(project, name, file)
        if not name.lower().endswith(".fmu"):
            raise MisfitError(f"{name} was not taken: expected a file that ends with .fmu")
        checked(file, name, "modelDescription.xml")
        folder = project.folder / side
        folder.mkdir(exist_ok=True)
        for other in folder.iterdir():
            other.unlink()
        file.replace(folder / f"{name[:-4]}.fmu")
        _forget(project)
        return f"{name} was taken."

    return take


def _recording(project: Project, name: str, file: Path) -> str:
    ending = Path(name).suffix.lower()
    if ending not in ENDINGS:
        raise MisfitError(f"{name} was not taken: expected a file that ends with {', '.join(ENDINGS)}")
    folder = project.folder / RECORDING
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir()
    file.replace(folder / f"recorded{ending}")
    return f'{name} was taken. Choose "{RECORDED}" under Inputs and press Compare.'


def _forget(project: Project) -> None:
    """What was found belongs to other files now."""
    (project.folder / "results" / RESULT).unlink(missing_ok=True)
    shutil.rmtree(project.folder / "job", ignore_errors=True)
