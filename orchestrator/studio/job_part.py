"""The bar with the main buttons, what is being done, and Cancel; it stays in sight and keeps its height."""

from collections.abc import Awaitable, Callable

from nicegui import run, ui

from orchestrator.studio import jobs
from orchestrator.studio.jobs import Job
from orchestrator.studio.project import COMPARISON, DIAGNOSIS, MATCH, VERSION, Project
from orchestrator.studio.tell import telling
from orchestrator.studio.versions import Versions, versions

DOING = {
    "match": "Looking at the columns",
    "compare": "Comparing",
    "diagnose": "Diagnosing",
    "add": "Adding the effect",
}
DONE = {"match": "Columns matched", "compare": "Compared", "diagnose": "Diagnosed", "add": "Added"}


class JobPart:
    """Buttons Compare, Diagnose, Add, Undo and Cancel, and two lines of text."""

    def __init__(self, project: Project) -> None:
        self.project = project
        with ui.element("section").classes("studio-bar").props('aria-label="Work"'):
            with ui.element("div").classes("studio-buttons"):
                self.compare = self._button("Compare", lambda: jobs.start(project, "compare"))
                self.diagnose = self._button("Diagnose", lambda: jobs.start(project, "diagnose"))
                self.add = self._button("Add", self._add)
                self.undo = self._button("Undo", self._undo).props("outline")
                self.cancel = self._button("Cancel", self._cancel).props("outline color=negative")
            self.busy = ui.element("div").classes("studio-busy").props('aria-hidden="true"')
            self.state = ui.label().classes("studio-state").props("role=status")
            self.hint = ui.label().classes("studio-hint")
        self.check()

    def _button(self, text: str, action: Callable[[], Awaitable[None] | None]) -> ui.button:
        async def click() -> None:
            with telling():
                result = action()
                if result is not None:
                    await result
            self.check()

        return ui.button(text, on_click=click).props("no-caps unelevated")

    def check(self) -> None:
        """Follow the disk."""
        project, job, now = self.project, jobs.look(self.project), versions(self.project)
        if job.state == "none" and project.data_files() and project.result(MATCH) is None:
            with telling():
                jobs.start(project, "match")
                job = jobs.look(project)
        matched = project.result(MATCH)
        ready = bool(matched and matched["model"] and not matched["problem"]) and not job.running
        self.compare.set_enabled(ready)
        self.diagnose.set_enabled(ready)
        self.add.set_enabled(ready and now.next is not None)
        self.undo.set_enabled(ready and now.number > 0)
        self.cancel.set_enabled(job.running)
        self.busy.props(f"data-running={str(job.running).lower()}")
        self.state.set_text(_state(job))
        self.state.classes(
            add="studio-problem" if job.state == "failed" else "",
            remove="" if job.state == "failed" else "studio-problem",
        )
        self.hint.set_text("" if job.running else _hint(project, job, now))

    def _add(self) -> None:
        number = versions(self.project).number + 1
        self.project.change(wanted=number)
        if self.project.result(VERSION.format(number)) is None:
            jobs.start(self.project, "add", [str(number)])

    def _undo(self) -> None:
        self.project.change(wanted=versions(self.project).number - 1)

    async def _cancel(self) -> None:
        await run.io_bound(jobs.cancel, self.project)


def _state(job: Job) -> str:
    seconds = f"{job.seconds:.0f} s"
    match job.state:
        case "none":
            return "Nothing has been done yet."
        case "running":
            return f"{DOING[job.kind]} · {seconds} · {job.message}"
        case "done":
            return f"{DONE[job.kind]} in {seconds}."
        case "cancelled":
            return f"{DOING[job.kind]}: {job.message} after {seconds}."
        case "failed":
            return f"{DOING[job.kind]} failed: {job.message}"


def _hint(project: Project, job: Job, now: Versions) -> str:
    """What to do next."""
    matched = project.result(MATCH)
    if not project.data_files():
        return "Next: drop in measurements."
    if job.state == "failed" and job.kind == "match":
        return "Next: correct that and upload the file again."
    if project.model is None:
        return "Next: choose a model or drop in an FMU."
    if matched is None or matched["problem"]:
        return "Next: correct what is said about the columns, then upload the file again."
    if project.result(COMPARISON) is None:
        return "Next: Compare shows where the model fails; Diagnose does that, too, and says what is missing."
    if project.result(DIAGNOSIS) is None:
        return "Next: Diagnose says which effect is missing."
    if now.next is not None:
        return f"Next: Add puts {now.next} into the model."
    if now.number == 0:
        return "There is nothing to add: no effect is named for sure."
    return "All that was named is in the model; download it below."
