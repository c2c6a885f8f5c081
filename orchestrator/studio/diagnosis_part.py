"""What is missing: verdict, evidence, what else it could be, and the next experiment."""

from typing import Any

from orchestrator.diagnosis.read_back import effects_of, ranking_of, tried_of
from orchestrator.report.numbers import digits, percent
from orchestrator.report.page import effects_table, experiment_rows, tried_table
from orchestrator.report.sentences import ranked_name
from orchestrator.studio.live import Live
from orchestrator.studio.project import DIAGNOSIS, Project, file_stamp
from orchestrator.studio.text import bullets, details, heading, html_table, page_table, paragraph

MOST_RANKED = 8


def diagnosis_part(project: Project) -> Live:
    """Add the part."""
    return Live(lambda: file_stamp(project.folder / "results" / DIAGNOSIS), lambda: _build(project))


def _build(project: Project) -> None:
    found = project.result(DIAGNOSIS)
    if found is None:
        return
    heading("What is missing")
    paragraph(found["sentence"], "studio-verdict")
    for each in effects_table(effects_of(found)):
        page_table(each)
    _ranking(found)
    _confusable(found)
    if found["warnings"]:
        heading("What the data leave open", 3)
        bullets(found["warnings"])
    pairs = experiment_rows(found["next_experiment"])
    if pairs:
        heading("Next experiment", 3)
        html_table("The experiment that would tell them apart", ("", "proposal"), pairs)
    bullets(found["findings"])
    with details("Tried and rejected"):
        for table in tried_table(tried_of(found)):
            page_table(table)


def _ranking(found: dict[str, Any]) -> None:
    ranked = ranking_of(found)[:MOST_RANKED]
    if not ranked or found["verdict"] == "adequate":
        return
    rows = [[ranked_name(each), percent(each.score), percent(each.probability)] for each in ranked]
    html_table("Effects, ranked by evidence", ("added to the model", "reducible error removed", "probability"), rows)


def _confusable(found: dict[str, Any]) -> None:
    groups = [" or ".join(name.replace("_", " ") for name in group) for group in found["confusable"]]
    if not groups and found["verdict"] != "named":
        return
    heading("What else it could be", 3)
    if groups:
        paragraph("These data cannot tell apart:")
        bullets(groups)
    else:
        paragraph("Nothing that was tried: these data tell the named effects from it.")
    bullets(
        f"{each['named'].replace('_', ' ')} or {each['rival'].replace('_', ' ')}: odds {digits(each['odds'])} to 1"
        for each in found["odds"]
    )
