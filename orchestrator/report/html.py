"""Reports as single HTML files that need no network, and no script but that of a replay."""

from collections.abc import Sequence
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING

from orchestrator.compare.result import Comparison
from orchestrator.ledger import LedgerEntry, newest
from orchestrator.report.answer import answer_of
from orchestrator.report.answer.markup import answer_html, answer_style
from orchestrator.report.answer.words import note_sentences
from orchestrator.report.arm_drawing import Replay, replay_script, replay_style, script_source
from orchestrator.report.numbers import digits
from orchestrator.report.page import (
    Page,
    Section,
    collinear_table,
    effects_table,
    excitation_table,
    experiment_rows,
    held_out_table,
    set_errors_table,
    trial_errors_table,
    tried_table,
    versions_table,
)
from orchestrator.report.palette import css_variables, dark_css
from orchestrator.report.pictures import (
    falling,
    latent,
    maps,
    moving,
    residual_pictures,
    step_versions,
    trial_pictures,
)
from orchestrator.report.provenance import ledger_provenance, provenance
from orchestrator.report.sentences import comparison_sentence, ledger_sentence
from orchestrator.report.summary import comparison_facts, comparison_plain
from orchestrator.report.where_tables import where_tables
from orchestrator.verdicts.result import Diagnosis

if TYPE_CHECKING:
    from jinja2 import Environment

# Parts behind the answer that are open from the beginning; the others show their heading until somebody wants to know.
UNFOLDED = 2
# Pictures and drawings of fixed colours stay on white in dark pages.
DRAWN = "figure img, .arm-replay svg, svg.curves"


def comparison_report(comparison: Comparison, replay: Replay | None = None) -> str:
    """Return the page of a comparison: how large the error is, where it is, and what it looks like."""
    pictures = residual_pictures(comparison)
    page = Page(
        title=f"Comparison of {comparison.model} with {_short(comparison.data)}",
        verdict=comparison_sentence(comparison),
        falling_error=pictures[0] if pictures else None,
        sections=(
            Section("Results", tables=(set_errors_table(comparison), trial_errors_table(comparison))),
            Section(
                "Where the model fails",
                comparison.findings,
                tables=where_tables(comparison.where, comparison.units, comparison.noise_floor),
            ),
            Section("Figures", pictures=(*trial_pictures(comparison, {}), *pictures[1:])),
            Section("Notes", (*comparison.notes, *comparison.noise_sentences)),
            Section("Provenance", pairs=provenance(comparison.model, comparison.data)),
        ),
        plain=comparison_plain(comparison),
        facts=comparison_facts(comparison),
        replay=moving(replay),
    )
    return render(page)


def diagnosis_report(diagnosis: Diagnosis, replay: Replay | None = None) -> str:
    """Return the page of a diagnosis: the verdict, the error that falls, and the evidence."""
    return render(_diagnosis_page(diagnosis, [], replay))


def discovery_report(diagnosis: Diagnosis, entries: list[LedgerEntry], replay: Replay | None = None) -> str:
    """Return the page of a discovery: the diagnosis with the ledger of the versions it led to.

    Args:
        diagnosis: the diagnosis.
        entries: versions of the ledger.
        replay: motion of the worst trial, for a planar arm.
    """
    return render(_diagnosis_page(diagnosis, entries, replay))


def ledger_report(entries: Sequence[LedgerEntry]) -> str:
    """Return the page of a ledger: the error that falls from version to version, and where each version comes from."""
    page = Page(
        title="Versions of a model" if not entries else f"Versions of {entries[0].name}",
        verdict=ledger_sentence(entries),
        falling_error=falling([(e.name, e.learning, e.held_out) for e in newest(entries)]),
        sections=(
            Section("Versions", tables=(versions_table(entries),) if entries else ()),
            Section("Effects of the newest version", tables=effects_table(entries[-1].effects if entries else ())),
            Section("Provenance", pairs=ledger_provenance(entries)),
        ),
    )
    return render(page)


def _diagnosis_page(diagnosis: Diagnosis, entries: list[LedgerEntry], replay: Replay | None) -> Page:
    given, final = diagnosis.steps[0].comparison, diagnosis.steps[-1].comparison
    effects = (entries[-1].effects if entries else ()) or diagnosis.effects
    versions = [(e.name, e.learning, e.held_out) for e in entries] or step_versions(diagnosis)
    changed = {} if final is given else {(curves.file, curves.set): curves for curves in final.curves}
    document = diagnosis.to_json()
    seconds = (("seconds", digits(diagnosis.seconds)),)
    return Page(
        title=f"{'Discovery' if entries else 'Diagnosis'}: {diagnosis.model} on {_short(diagnosis.data)}",
        verdict="",
        falling_error=falling(versions),
        sections=(
            Section(
                "What is missing",
                tables=(
                    *effects_table(effects),
                    *held_out_table(diagnosis.held_out, given.units),
                    *((versions_table(entries),) if entries else ()),
                ),
            ),
            Section("What the data leave open", tuple(note_sentences(diagnosis.warnings)), warns=True),
            Section("Next experiment", pairs=experiment_rows(diagnosis.next_experiment)),
            Section(
                "Where the model as given fails",
                (*diagnosis.findings, *given.findings),
                pictures=(*latent(diagnosis), *maps(diagnosis.where, "the missing force")),
            ),
            Section("Tried and rejected", tables=(*tried_table(diagnosis.tried), *collinear_table(diagnosis.kin))),
            Section(
                "Before, after and the noise floor",
                tables=(set_errors_table(final, f"Error (rms) of each set, {_subject(final is given)}"),),
                pictures=tuple(trial_pictures(given, changed)),
            ),
            Section("What the data excite", tables=excitation_table(diagnosis.excitation)),
            Section(
                "Errors of the model as given in detail",
                tables=where_tables(given.where, given.units, given.noise_floor),
                pictures=tuple(residual_pictures(given)),
            ),
            Section("Notes", (*given.notes, *given.noise_sentences)),
            Section(
                "Provenance", pairs=provenance(diagnosis.model, diagnosis.data) + seconds + ledger_provenance(entries)
            ),
        ),
        replay=moving(replay),
        answer=answer_html(answer_of(document), document),
    )


def _subject(as_given: bool) -> str:
    return "model as given" if as_given else "with the effects added"


def _short(path: str) -> str:
    return Path(path).name or path


def render(page: Page) -> str:
    """Return a page as one HTML file; a browser runs no script on it but that of the replay, if there is one."""
    return _filled("report.html.j2", page, ":root", dark_css(DRAWN))


def render_part(page: Page) -> str:
    """Return a page as a part of another, such as the output of a cell: its title and headings are left out."""
    return _filled("notebook.html.j2", page, ".misfit-report", "")


def _filled(template: str, page: Page, selector: str, dark: str) -> str:
    script = replay_script() if page.replay else ""
    return (
        _templates()
        .get_template(template)
        .render(
            page=page,
            shown=[(f"part-{number}", part) for number, part in enumerate(page.sections) if not part.is_empty],
            unfolded=UNFOLDED,
            colours=css_variables(selector) + dark,
            style=(replay_style() if page.replay else "") + (answer_style() if page.answer else ""),
            script=script,
            policy=f"; script-src {script_source()}" if script else "",
        )
    )


@cache
def _templates() -> "Environment":
    from jinja2 import Environment, FileSystemLoader, StrictUndefined

    return Environment(
        loader=FileSystemLoader(Path(__file__).parent / "templates"),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
