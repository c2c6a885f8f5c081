"""Behind the answer: parameters, what the data leave open, the next experiment, and what was tried."""

from typing import Any

from orchestrator.report.answer.notes import note_sentences
from orchestrator.report.page import effects_table, experiment_rows, tried_table
from orchestrator.report.sentences import experiment_sentence
from orchestrator.studio.live import Live
from orchestrator.studio.project import DIAGNOSIS, Project, file_stamp
from orchestrator.studio.text import bullets, details, heading, html_table, page_table, paragraph
from orchestrator.verdicts.read_back import effects_of, tried_of


def diagnosis_part(project: Project) -> Live:
    """Add the part."""
    return Live(lambda: file_stamp(project.folder / "results" / DIAGNOSIS), lambda: _build(project))


def _build(project: Project) -> None:
    found = project.result(DIAGNOSIS)
    if found is None:
        return
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
