"""Reports as single HTML files that need no network, and no script but that of a replay."""

from collections.abc import Mapping, Sequence
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

from orchestrator.arm_drawing import Replay, Scales, replay_html, replay_script, replay_style, script_source
from orchestrator.compare.result import Comparison, TrialCurves
from orchestrator.diagnosis.result import Diagnosis
from orchestrator.ledger import LedgerEntry
from orchestrator.report import figures
from orchestrator.report.numbers import digits
from orchestrator.report.page import (
    Page,
    Picture,
    Section,
    effects_table,
    excitation_table,
    experiment_rows,
    held_out_table,
    kin_table,
    set_errors_table,
    trial_errors_table,
    tried_table,
    versions_table,
)
from orchestrator.report.palette import css_variables
from orchestrator.report.provenance import ledger_provenance, provenance
from orchestrator.report.sentences import comparison_sentence, effect_name, ledger_sentence, verdict_sentence
from orchestrator.report.summary import comparison_facts, comparison_plain, diagnosis_facts, diagnosis_plain
from orchestrator.report.where_tables import where_tables

if TYPE_CHECKING:
    from jinja2 import Environment


def comparison_report(comparison: Comparison, replay: Replay | None = None) -> str:
    """Return the page of a comparison: how large the error is, where it is, and what it looks like."""
    pictures = _residual_pictures(comparison)
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
            Section("Figures", pictures=(*_trial_pictures(comparison, {}), *pictures[1:])),
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
    """Return the page of a discovery: the diagnosis with the ledger of the versions it led to."""
    return render(_diagnosis_page(diagnosis, entries, replay))


def ledger_report(entries: Sequence[LedgerEntry]) -> str:
    """Return the page of a ledger: the error that falls from version to version, and where each version comes from."""
    page = Page(
        title="Versions of a model" if not entries else f"Versions of {entries[0].name}",
        verdict=ledger_sentence(entries),
        falling_error=falling([(e.name, e.learning, e.held_out) for e in entries]),
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
    seconds = (("seconds", digits(diagnosis.seconds)),)
    return Page(
        title=f"{'Discovery' if entries else 'Diagnosis'}: {diagnosis.model} on {_short(diagnosis.data)}",
        verdict=verdict_sentence(diagnosis),
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
            Section("What the data leave open", diagnosis.warnings, warns=True),
            Section("Next experiment", pairs=experiment_rows(diagnosis.next_experiment)),
            Section(
                "Where the model as given fails",
                (*diagnosis.findings, *given.findings),
                pictures=(*_latent(diagnosis), *_maps(diagnosis.where, "the missing force")),
            ),
            Section(
                "Tried and rejected",
                tables=(*tried_table(diagnosis.tried), *kin_table(diagnosis.kin)),
                pictures=_ranking(diagnosis),
            ),
            Section(
                "Before, after and the noise floor",
                tables=(set_errors_table(final, f"Error (rms) of each set, {_subject(final is given)}"),),
                pictures=tuple(_trial_pictures(given, changed)),
            ),
            Section("What the data excite", tables=excitation_table(diagnosis.excitation)),
            Section(
                "Errors of the model as given in detail",
                tables=where_tables(given.where, given.units, given.noise_floor),
                pictures=tuple(_residual_pictures(given)),
            ),
            Section("Notes", (*given.notes, *given.noise_sentences)),
            Section(
                "Provenance", pairs=provenance(diagnosis.model, diagnosis.data) + seconds + ledger_provenance(entries)
            ),
        ),
        plain=diagnosis_plain(diagnosis),
        facts=diagnosis_facts(diagnosis),
        replay=moving(replay),
    )


def moving(replay: Replay | None) -> Picture | None:
    """The replay as a part of a page; its drawing explains itself, as it is no photograph."""
    if replay is None:
        return None
    frames = [replay.instant(k) for k in replay.frames()]
    size = Scales.of(replay.shape, frames).words()
    caption = (
        "Dashed: where the model puts the arm. Round arrows: torque that the model lacks at a joint, with its 90 % band"
        f"{f' ({size})' if size else ''}. Muscles: the more active, the thicker; their distances from joints are their "
        "moment arms, to scale; where they begin and end is not in the model and drawn by eye."
    )
    return Picture(replay_html(replay, "Replay of the worst trial"), caption)


def step_versions(diagnosis: Diagnosis) -> list[figures.Version]:
    versions: list[figures.Version] = []
    known: set[tuple[str, str]] = set()
    for step in diagnosis.steps:
        added = [effect_name(effect) for effect in step.effects if (effect.id, effect.site) not in known]
        known |= {(effect.id, effect.site) for effect in step.effects}
        name = "+ " + ", ".join(added) if added else "as given"
        versions.append((name, step.comparison.learning, step.comparison.held_out))
    return versions


def falling(versions: Sequence[figures.Version]) -> Picture | None:
    if len(versions) < 2:
        return None
    return Picture(figures.falling_error(versions), "The error of each version, as a multiple of the noise floor.")


def _ranking(diagnosis: Diagnosis) -> tuple[Picture, ...]:
    if not diagnosis.ranking:
        return ()
    return (Picture(figures.ranking(diagnosis), "What was tried, best first."),)


def _latent(diagnosis: Diagnosis) -> list[Picture]:
    return [Picture(figures.latent_curve(curve), f"{curve.sentence()}.") for curve in diagnosis.latent_forces]


def _maps(rows: Sequence[Mapping[str, Any]], what: str) -> list[Picture]:
    """A figure for each signal: the four coordinates on which it depends most."""
    pictures = []
    for name in dict.fromkeys(str(row["signal"]) for row in rows if "low" in row):
        mine = [row for row in rows if row["signal"] == name]
        caption = (
            f"Where {what} is: {name} over the quantities it depends on most; grey is what chance alone gives (95 %)."
        )
        pictures.append(Picture(figures.error_maps(name, mine), caption))
    return pictures


def _trial_pictures(comparison: Comparison, changed: Mapping[tuple[str, str], TrialCurves]) -> list[Picture]:
    shown = "Measured and modelled curves of {}, with the residual (measured minus modelled) below."
    return [
        Picture(figures.trial_curves(comparison, trial, changed.get((trial.file, trial.set))), shown.format(trial.file))
        for trial in figures.shown_trials(comparison)
    ]


def _residual_pictures(comparison: Comparison) -> list[Picture]:
    if not comparison.curves:
        return []
    pictures = [Picture(figures.error_by_trial(comparison), "Error of each trial; the dashed line is the noise floor.")]
    for name in figures.shown_signals(comparison):
        caption = f"Residual of {name} against each measured signal and its speed, all trials."
        pictures.append(Picture(figures.residual_against_state(comparison, name), caption))
    pictures += _maps(comparison.where.get("state", []), "the error of free runs")
    caption = "Residual by frequency, all trials; the dashed line is the noise floor if it were white."
    return [*pictures, Picture(figures.residual_spectrum(comparison), caption)]


def _subject(as_given: bool) -> str:
    return "model as given" if as_given else "with the effects added"


def _short(path: str) -> str:
    return Path(path).name or path


def render(page: Page) -> str:
    """Return a page as one HTML file; a browser runs no script on it but that of the replay, if there is one."""
    return _filled("report.html.j2", page, ":root")


def render_part(page: Page) -> str:
    """Return a page as a part of another, such as the output of a cell: its title and headings are left out."""
    return _filled("notebook.html.j2", page, ".misfit-report")


def _filled(template: str, page: Page, selector: str) -> str:
    script = replay_script() if page.replay else ""
    return (
        _templates()
        .get_template(template)
        .render(
            page=page,
            shown=[(f"part-{number}", part) for number, part in enumerate(page.sections) if not part.is_empty],
            colours=css_variables(selector),
            style=replay_style() if page.replay else "",
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
