"""The page of a project: the whole main job from top to bottom, with those of its parts that are nowhere else."""

from collections.abc import Callable
from typing import Any, Self

from nicegui import ui

from fmus.errors import MisfitError
from orchestrator.report.answer.words import note_sentences
from orchestrator.report.page import effects_table, experiment_rows, tried_table
from orchestrator.report.sentences import experiment_sentence
from orchestrator.studio import workspace
from orchestrator.studio.answer_part import AnswerPart
from orchestrator.studio.columns_part import columns_part, problem_part
from orchestrator.studio.comparison_part import comparison_part
from orchestrator.studio.job_part import JobPart
from orchestrator.studio.pages import Live, Page, Part, result_part
from orchestrator.studio.project import COMPARISON, DIAGNOSIS, REPLAY, Project, file_stamp
from orchestrator.studio.routes import REPORTS, downloads
from orchestrator.studio.setup_part import setup_part, setup_words
from orchestrator.studio.text import bullets, details, heading, html_table, page_table, paragraph
from orchestrator.studio.versions import versions
from orchestrator.studio.views.page import error_steps
from orchestrator.studio.views.steps_view import StepsView
from orchestrator.verdicts.read_back import effects_of, tried_of


class Folded:
    """`words` gives the line ("" hides the part), `opened` whether it is open; a click holds until `opened` changes."""

    def __init__(self, id: str, words: Callable[[], str], opened: Callable[[], bool]) -> None:
        self._words, self._opened = words, opened
        self._seen: bool | None = None
        self._box = ui.element("details").classes("studio-folded").props(f"id={id}")
        with self._box:
            with ui.element("summary"):
                self._line = ui.label("")
            self._inside = ui.element("div")
        self.check()

    def check(self) -> None:
        """Follow the disk."""
        words = self._words()
        self._line.set_text(words)
        self._box.set_visibility(bool(words))
        opened = self._opened()
        if opened == self._seen:
            return
        self._seen = opened
        if opened:
            self._box.props("open")
        else:
            self._box.props(remove="open")
        script = f"const box = document.getElementById('{self._box.props['id']}'); if (box) box.open = {str(opened).lower()};"
        ui.run_javascript(script)

    def __enter__(self) -> Self:
        self._inside.__enter__()
        return self

    def __exit__(self, *reason: object) -> None:
        self._inside.__exit__(*reason)


def diagnosis_part(project: Project) -> Live:
    """Add the part."""
    return result_part(project, DIAGNOSIS, _build_diagnosis)


def _build_diagnosis(found: dict[str, Any]) -> None:
    heading("What was found")
    for each in effects_table(effects_of(found)):
        page_table(each)
    bullets(f"{finding}." for finding in found["findings"])
    if found["warnings"]:
        heading("What the data leave open", 3)
        bullets(note_sentences(found["warnings"]))
    _experiment(found)
    with details("Tried and rejected"):
        for table in tried_table(tried_of(found)):
            page_table(table)


def _experiment(found: dict[str, Any]) -> None:
    """The experiment that was proposed, and what it would show; nothing where none was."""
    proposed = found["next_experiment"]
    if not proposed:
        return
    heading("Next experiment", 3)
    paragraph(experiment_sentence(proposed))
    with details("Its figures"):
        html_table("The proposed experiment", ("", "proposal"), experiment_rows(proposed))


MEANING = {
    ".fmu": "the model with the effect in it, as FMU",
    ".mo": "the same as Modelica",
    ".toml": "the system of the FMU and its effects",
    ".html": "report, self-contained; it prints well",
    ".json": "machine-readable result",
    ".jsonl": "all versions with their errors",
    ".csv": "inputs of the next experiment",
}


def downloads_part(project: Project) -> Live:
    """Add the part."""
    return Live(lambda: tuple((f.name, file_stamp(f)) for f in downloads(project)), lambda: _build_downloads(project))


def _build_downloads(project: Project) -> None:
    files = downloads(project)
    if not files:
        return
    heading("Take away")
    address = f"/project/{project.id}/download"
    with ui.element("ul").classes("studio-files"):
        for file in sorted(files, key=lambda file: list(MEANING).index(file.suffix) if file.suffix in MEANING else 9):
            with ui.element("li"):
                ui.link(file.name, f"{address}/{file.name}", new_tab=file.name in REPORTS)
                ui.label(MEANING.get(file.suffix, "part of the system")).classes("studio-hint")
    ui.link("All of them in a zip", f"{address}/everything.zip")


def replay_part(project: Project) -> Live:
    """Add the part."""
    return result_part(project, REPLAY, _build_replay)


def _build_replay(found: dict[str, Any]) -> None:
    heading("The arm in motion, as given")
    # Made by a job of this project from numbers; nothing of it is a user's text.
    box = ui.html(found["markup"], sanitize=False)
    paragraph(found["caption"], "studio-hint")
    ui.timer(0.05, lambda: _mount_replay(box), once=True)


def _mount_replay(box: ui.html) -> None:
    ui.run_javascript(f"document.querySelectorAll('#{box.html_id} .arm-replay').forEach(misfitArm.mount)")


class VersionsPart:
    """The ledger as a picture; a version that is added falls from the height of the one before."""

    def __init__(self, project: Project) -> None:
        self.project = project
        self._view: StepsView | None = None
        self._seen: object = None
        self._live = Live(lambda: bool(versions(project).shown), self._build)

    def _build(self) -> None:
        shown = versions(self.project).shown
        self._seen, self._view = shown, None
        if shown:
            self._view = error_steps(shown)

    def check(self) -> None:
        """Follow the disk."""
        self._live.check()
        shown = versions(self.project).shown
        if self._view is not None and shown != self._seen:
            self._seen = shown
            self._view.show(shown)


EVERY_S = 0.5


def register() -> Page:
    """The page of a project."""
    return Page("/project/{project}", "Project", build)


def build(project: str) -> None:
    """All parts; each follows the disk, so a reload or a second tab shows the same."""
    try:
        shown = workspace.current().project(project)
        ui.page_title(f"{shown.name} · misfit studio")
    except MisfitError as error:
        heading("No such project", 1)
        paragraph(str(error), "studio-problem")
        ui.link("Go to the start page", "/")
        return

    def diagnosed() -> bool:
        return shown.result(DIAGNOSIS) is not None

    def compared() -> bool:
        return shown.result(COMPARISON) is not None

    with ui.element("div").classes("studio-top"):
        name = Live(lambda: shown.name, lambda: heading(shown.name, 1))
        bar = JobPart(shown)
    parts: list[Part] = [name, bar, problem_part(shown)]
    with Folded("setup", lambda: setup_words(shown), lambda: not diagnosed() and not compared()) as setup:
        parts += [setup, *setup_part(shown), columns_part(shown)]
    parts.append(AnswerPart(shown))
    with Folded(
        "why",
        lambda: "Why do you think so?" if diagnosed() else "Where the model fails" if compared() else "",
        lambda: compared() and not diagnosed(),
    ) as why:
        parts += [why, diagnosis_part(shown), VersionsPart(shown), replay_part(shown), comparison_part(shown)]
    parts.append(downloads_part(shown))

    def follow() -> None:
        if not shown.exists:
            timer.cancel()
            ui.navigate.to("/")
            return
        for part in parts:
            part.check()

    timer = ui.timer(EVERY_S, follow)
