"""The bar with the main buttons, what is being done, and Cancel; it stays in sight and keeps its height."""

from collections.abc import Awaitable, Callable
from typing import Any

from nicegui import run, ui

from orchestrator.elapsed import in_words
from orchestrator.studio import jobs
from orchestrator.studio.jobs import Job
from orchestrator.studio.project import COMPARISON, DIAGNOSIS, MATCH, Project
from orchestrator.studio.text import telling
from orchestrator.studio.versions import Versions, versions

DOING = {
    "match": "Looking at the columns",
    "compare": "Comparing",
    "diagnose": "Diagnosing",
    "add": "Adding the effect",
}
DONE = {"compare": "Compared", "diagnose": "Diagnosed", "add": "Added"}


STEPS = ("Data", "Compare", "Diagnose", "Add", "Take away")


class JobPart:
    """How far the work has gone, the buttons Diagnose, Compare and Cancel, and two lines of text while they are needed."""

    def __init__(self, project: Project) -> None:
        self.project = project
        with ui.element("section").classes("studio-bar").props('aria-label="Work"'):
            with ui.element("div").classes("studio-line"):
                self.steps = ui.html("", sanitize=False, tag="ol").classes("studio-steps")
                with ui.element("div").classes("studio-buttons"):
                    self.diagnose = self._button("Diagnose", lambda: jobs.start(project, "diagnose"))
                    self.compare = self._button("Compare", lambda: jobs.start(project, "compare")).props("flat")
                    self.cancel = self._button("Cancel", self._cancel).props("outline color=negative")
            self.busy = ui.element("div").classes("studio-busy").props('aria-hidden="true"')
            with ui.element("div").classes("studio-words") as self.words:
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
        self.cancel.set_visibility(job.running)
        diagnosed = project.result(DIAGNOSIS) is not None
        # Diagnose compares, too; once it has, the answer's own button is the one to press.
        self.compare.set_visibility(not diagnosed)
        self.diagnose.props("outline" if diagnosed else "", remove="" if diagnosed else "outline")
        self.words.set_visibility(not diagnosed or job.running or job.state in ("failed", "cancelled"))
        self.busy.props(f"data-running={str(job.running).lower()}")
        self.steps.set_content(_steps(project, ready or job.running, now))
        self.state.set_text(_state(job, matched))
        self.state.classes(
            add="studio-problem" if job.state == "failed" else "",
            remove="" if job.state == "failed" else "studio-problem",
        )
        self.hint.set_text("" if job.running else _hint(project, job, now))

    async def _cancel(self) -> None:
        await run.io_bound(jobs.cancel, self.project)


def _steps(project: Project, matched: bool, now: Versions) -> str:
    """The steps of the work, those that are done with a tick, the latest in bold."""
    diagnosed = project.result(DIAGNOSIS) is not None
    compared = diagnosed or project.result(COMPARISON) is not None
    done = [matched, compared, diagnosed, now.number > 0, False]
    last = max((place for place, each in enumerate(done) if each), default=-1)
    entries = []
    for place, (name, is_done) in enumerate(zip(STEPS, done, strict=True)):
        current = ' aria-current="step"' if place == last else ""
        tick = '<span aria-hidden="true">✓ </span>' if is_done else ""
        hidden = '<span class="studio-unseen"> (done)</span>' if is_done else ""
        entries.append(f"<li{current}>{tick}{name}{hidden}</li>")
    return "".join(entries)


def _state(job: Job, matched: dict[str, Any] | None) -> str:
    seconds = f"{job.seconds:.0f} s"
    match job.state:
        case "none":
            return "Nothing has been done yet."
        case "running":
            return " · ".join(filter(None, (DOING[job.kind], job.gone, seconds, in_words(job.message))))
        case "done" if job.kind == "match":
            return _matched_words(matched)
        case "done":
            return f"{DONE[job.kind]} in {seconds}."
        case "cancelled":
            return f"{DOING[job.kind]}: {job.message} after {seconds}."
        case "failed":
            return f"{DOING[job.kind]} failed: {job.message}"


def _matched_words(matched: dict[str, Any] | None) -> str:
    """How many columns found a variable; nothing is matched where none did."""
    if matched is None or matched["model"] is None:
        return "The files are read; no model is chosen yet."
    found = sum(bool(row["variable"]) for row in matched["columns"])
    but = "; they cannot be used yet" if matched["problem"] else ""
    return f"{found} of {len(matched['columns'])} columns are variables of the model{but}."


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
        return ""  # what to do stands where an answer would
    if project.result(COMPARISON) is None:
        return "Next: Diagnose says what is missing."
    if project.result(DIAGNOSIS) is None:
        return "Next: Diagnose says which effect is missing."
    return ""
