"""How large the error is against the noise floor, and where."""

from pathlib import Path

from nicegui import ui

from fmus.errors import MisfitError
from orchestrator.report.page import set_errors_table, trial_errors_table
from orchestrator.report.sentences import comparison_sentence
from orchestrator.report.where_tables import where_tables
from orchestrator.studio.pages import Live
from orchestrator.studio.project import COMPARISON, VERSION, VIEWS, Project, file_stamp
from orchestrator.studio.text import bullets, details, heading, page_table, paragraph
from orchestrator.studio.versions import versions
from orchestrator.studio.views import store
from orchestrator.studio.views.link import SelectionLink
from orchestrator.studio.views.page import comparison_views
from orchestrator.verdicts.read_back import comparison_of


def comparison_part(project: Project) -> Live:
    """Add the part; it shows the version of the model that is chosen now."""

    def stamp() -> object:
        number = versions(project).number
        results = project.folder / "results"
        return number, file_stamp(results / COMPARISON), file_stamp(results / VIEWS.format(number) / "views.json")

    links: list[SelectionLink] = []
    return Live(stamp, lambda: _build(project, links))


def _build(project: Project, links: list[SelectionLink]) -> None:
    now = versions(project)
    document = project.result(COMPARISON)
    if now.number and (built := project.result(VERSION.format(now.number))):
        document = built["comparison"]
    if document is None:
        return
    found = comparison_of(document)
    heading("Where the model fails")
    paragraph("The model as given." if now.number == 0 else f"Version {now.number} of the model.", "studio-hint")
    paragraph(comparison_sentence(found), "studio-verdict")
    page_table(set_errors_table(found))
    bullets(found.findings)
    with details("Errors of each trial"):
        page_table(trial_errors_table(found))
    with details("Where the error is, as tables"):
        for each in where_tables(found.where, found.units, found.noise_floor):
            page_table(each)
    with details("Notes"):
        bullets(found.notes)
    _views_later(project.results / VIEWS.format(now.number), links)


def _views_later(folder: Path, links: list[SelectionLink]) -> None:
    """Add the plots after the page has been painted: their library is larger than all the rest.

    `links` holds that of the version shown before, if any: what is selected stays so when a version is added.
    """
    box = ui.element("div").classes("studio-views")

    def fill() -> None:
        with box:
            try:
                links[:] = [comparison_views(store.read(folder), *links)]
            except MisfitError as error:
                paragraph(str(error), "studio-problem")

    ui.timer(0.05, fill, once=True)
