"""Which column is which variable, in which unit, and the trials."""

from orchestrator.report.numbers import digits
from orchestrator.studio.live import Live
from orchestrator.studio.project import MATCH, Project, file_stamp
from orchestrator.studio.text import bullets, details, heading, html_table, paragraph

HEADINGS = ("column", "unit", "model variable", "unit in the model", "conversion", "what becomes of it")


def columns_part(project: Project) -> Live:
    """Add the part."""
    return Live(lambda: file_stamp(project.folder / "results" / MATCH), lambda: _build(project))


def _build(project: Project) -> None:
    found = project.result(MATCH)
    if found is None:
        return
    heading("Columns and units")
    if found["problem"]:
        paragraph(found["problem"], "studio-problem")
    keys = ("column", "unit", "variable", "model_unit", "conversion", "role")
    html_table("Columns of the measurements", HEADINGS, [[row[key] for key in keys] for row in found["columns"]])
    trials = [[t["file"], t["set"], str(t["samples"]), f"{digits(t['seconds'])} s"] for t in found["trials"]]
    with details(f"{len(trials)} trials"):
        html_table("Trials", ("trial", "set", "samples", "length"), trials)
    if found["notes"]:
        with details("What was converted and assumed"):
            bullets(found["notes"])
