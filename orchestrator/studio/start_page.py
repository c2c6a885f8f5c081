"""The first page: examples to try, a new project, and the projects there are."""

from collections.abc import Callable, Hashable

from nicegui import run, ui

from orchestrator.report.answer import answer_of
from orchestrator.report.answer.residual import worst_residual
from orchestrator.studio import jobs, workspace
from orchestrator.studio.columns_part import small_curve
from orchestrator.studio.examples import EXAMPLES, open_example
from orchestrator.studio.names import model_words
from orchestrator.studio.pages import Live, Page
from orchestrator.studio.project import DIAGNOSIS, Project, file_stamp
from orchestrator.studio.text import heading, paragraph
from orchestrator.studio.versions import versions


def register() -> Page:
    """The start page."""
    return Page("/", "Projects", build, order=0)


def build() -> None:
    """What the studio does, examples, and the projects."""
    heading("Where does your model fail, and what is missing?", 1)
    paragraph(
        "Give a model and measurements. You see where they part, which physical effect is missing, "
        "and, once it is added, how the error falls towards the noise."
    )
    ui.button("New project", on_click=_new).props("no-caps unelevated")
    heading("Examples")
    with ui.element("div").classes("studio-cards"):
        for example in EXAMPLES:
            with ui.element("section").classes("studio-card").props(f'aria-label="{example.title}"'):
                heading(example.title, 3)
                paragraph(example.text)
                ui.button("Open", on_click=_opener(example.id)).props(
                    f'no-caps outline aria-label="Open: {example.title}"'
                )
    heading("Projects")
    listed = Live(lambda: tuple(_stamp(p) for p in workspace.current().projects()), _projects)
    ui.timer(2.0, listed.check)


def _stamp(project: Project) -> Hashable:
    return project.id, project.name, project.model, project.wanted, file_stamp(project.folder / "results" / DIAGNOSIS)


def _new() -> None:
    """A new project; its number tells it from the others until it gets a name of its own."""
    home = workspace.current()
    _open(home.create(f"Project {len(home.projects()) + 1}"))


def _opener(id: str) -> Callable[[], None]:
    return lambda: _open(open_example(workspace.current(), id))


def _open(project: Project) -> None:
    ui.navigate.to(f"/project/{project.id}")


def _projects() -> None:
    projects = workspace.current().projects()
    if not projects:
        paragraph("None yet. Open an example, or begin a new project with a model and measurements of your own.")
        return
    with ui.element("ul").classes("studio-files"):
        for project in projects:
            with ui.element("li"):
                ui.link(project.name, f"/project/{project.id}")
                ui.label(_words(project))
                ui.html(_spark(project), sanitize=False)
                ui.label(project.created.replace("T", " ")[:16] + " UTC").classes("studio-hint")
                ui.button("Remove", on_click=_remover(project)).props(
                    f'flat dense no-caps aria-label="Remove {project.name}"'
                )


def _words(project: Project) -> str:
    """The model, and the answer in one sentence."""
    document = project.result(DIAGNOSIS)
    found = answer_of(document).headline if document else "not diagnosed yet"
    return f"{model_words(project.model or 'no model yet')} · {found}"


def _spark(project: Project) -> str:
    """As large as a word: how the error fell from version to version; before anything is added, the error along its worst trial."""
    errors = [(each.held_out or each.learning).over_floor for each in versions(project).shown]
    if len(errors) > 1:
        return small_curve(errors)
    worst = worst_residual(project.result(DIAGNOSIS) or {})
    return "" if worst is None else small_curve(worst.before[:: max(1, len(worst.before) // 60)].tolist())


def _remover(project: Project) -> Callable[[], object]:
    async def remove() -> None:
        with ui.dialog().props('aria-label="Remove a project"') as dialog, ui.card():
            paragraph(f"Remove {project.name} with its measurements and results? They cannot be brought back.")
            with ui.row():
                ui.button("Keep it", on_click=lambda: dialog.submit(False)).props("no-caps outline")
                ui.button("Remove it", on_click=lambda: dialog.submit(True)).props("no-caps color=negative")
        if await dialog:
            await run.io_bound(jobs.cancel, project)
            await run.io_bound(workspace.current().remove, project)

    return remove
