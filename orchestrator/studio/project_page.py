"""The page of a project: the whole main job from top to bottom."""

from nicegui import ui

from fmus.errors import MisfitError
from orchestrator.studio import workspace
from orchestrator.studio.answer_part import AnswerPart
from orchestrator.studio.columns_part import columns_part
from orchestrator.studio.comparison_part import comparison_part
from orchestrator.studio.diagnosis_part import diagnosis_part
from orchestrator.studio.downloads_part import downloads_part
from orchestrator.studio.folded import Folded
from orchestrator.studio.job_part import JobPart
from orchestrator.studio.live import Live, Part
from orchestrator.studio.pages import Page
from orchestrator.studio.project import COMPARISON, DIAGNOSIS
from orchestrator.studio.replay_part import replay_part
from orchestrator.studio.setup_part import setup_part, setup_words
from orchestrator.studio.text import heading, paragraph
from orchestrator.studio.versions_part import VersionsPart

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
    parts: list[Part] = [name, bar]
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
