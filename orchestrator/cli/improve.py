"""`misfit add`, `misfit ledger` and `misfit discover`."""

import json
from dataclasses import asdict
from pathlib import Path
from typing import Any

import click

from fmus.errors import MisfitError
from orchestrator.cli.common import (
    can_be_filled,
    cards_option,
    html_option,
    json_option,
    library_option,
    mend_option,
    mended_record,
    progress,
    result_options,
    scheduler_option,
    show,
    tolerance_option,
    write_file,
    write_json,
)

RESULTS = "misfit-results"


@click.command()
@click.argument("diagnosis_or_effect", metavar="DIAGNOSIS|EFFECT|CARD")
@library_option
@click.option("--to", "model", metavar="MODEL", help="The model to extend; for a DIAGNOSIS its own model by default.")
@click.option(
    "--out",
    "folder",
    default=".",
    show_default=True,
    metavar="DIR",
    callback=can_be_filled,
    help="Where to write NAME.mo and NAME.fmu.",
)
@cards_option
@click.option("--quiet", is_flag=True, help="Print nothing but errors.")
def add(diagnosis_or_effect: str, model: str | None, folder: str, card_folders: tuple[Path, ...], quiet: bool) -> None:
    """Write a model with an effect in it, as Modelica and FMU; the original is not touched.

    DIAGNOSIS is a file written by `misfit diagnose --json` or `misfit discover --json`; of one that names no effect but
    proposes a law, the first law is added. EFFECT is an effect id, added with its card's first guess, or the id of a law of
    --cards; CARD is a law card (*.toml). Laws are added with the values that were found with them.
    """
    from orchestrator.greybox.effects import law_effects
    from orchestrator.greybox.laws import own_laws, read_law
    from orchestrator.library.cards import effect_library
    from orchestrator.model_argument import load_modelica
    from orchestrator.verdicts.read_back import adjusted_of, effects_of
    from orchestrator.versions import add_effects, default_effect

    cards, laws = effect_library(card_folders), own_laws(card_folders)
    if diagnosis_or_effect.endswith(".toml"):
        laws = (read_law(Path(diagnosis_or_effect)),)
        diagnosis_or_effect = laws[0].id
    if diagnosis_or_effect.endswith(".json"):
        document = _read_diagnosis(Path(diagnosis_or_effect))
        _with_libraries(document, diagnosis_or_effect)
        base = _base(model or _model_of(document, diagnosis_or_effect), document["data"])
        effects = effects_of(document)
        if not effects and document.get("laws"):
            laws = (read_law(Path(document["laws"][0]["card"])),)
            effects = law_effects(base, laws[0])
        if not effects:
            raise MisfitError(
                f"{diagnosis_or_effect} names no effect (verdict: {document['verdict']}), so there is nothing to add"
            )
        # Tolerances were fitted for the diagnosed model; another one has parameters of its own.
        fitted = document.get("nuisances", {}).get("parameters", [])
        adjusted = adjusted_of(fitted) if model in (None, document["model"]) else []
    else:
        if model is None:
            raise click.UsageError(f"name the model that gets {diagnosis_or_effect} with --to MODEL")
        base, adjusted = load_modelica(model), []
        law = next((law for law in laws if law.id == diagnosis_or_effect), None)
        effects = law_effects(base, law) if law else [default_effect(base, diagnosis_or_effect, cards)]
    version = add_effects(base, effects, Path(folder), cards, adjusted, laws)
    show("\n".join(map(str, version.files)), quiet)


def _base(model: str, data: str) -> Any:
    """What a diagnosis was made for; an FMU offers its sites for the diagnosis' data."""
    from orchestrator.measurements import load_measurements
    from orchestrator.model_argument import load_modelica, load_source, runs_as_fmu

    return load_source(model, load_measurements(data)) if runs_as_fmu(model) else load_modelica(model)


def _model_of(document: dict[str, Any], path: str) -> str:
    """The model that a diagnosis was made for, as an argument."""
    own = str(document.get("model_file", ""))
    if own and not Path(own.rpartition(":")[0]).is_file():
        raise MisfitError(
            f"{path} was made for {own}, which is not there; name the model where it is now with --to FILE.mo:CLASS"
        )
    return own or str(document["model"])


def _with_libraries(document: dict[str, Any], path: str) -> None:
    """Look for classes where the diagnosis found them; folders that are named now go before."""
    from fmus.library import add_library, library_folders

    now = library_folders()
    for folder in document.get("libraries", ()):
        if Path(folder).is_dir():
            add_library(Path(folder))
        elif not now:
            raise MisfitError(
                f"{path} was made with the library folder {folder}, which is not there; name where it is now with --library DIR"
            )
    for folder in reversed(now):
        add_library(Path(folder))


def _read_diagnosis(path: Path) -> dict[str, Any]:
    from orchestrator.verdicts.read_back import effects_of

    try:
        document = json.loads(path.read_text())
    except OSError as error:
        raise MisfitError(f"diagnosis {path} cannot be read: {error.strerror}") from error
    except ValueError as error:
        raise MisfitError(f"diagnosis {path} is not JSON: {error}") from error
    if not isinstance(document, dict) or document.get("schema") != "misfit.diagnosis/1":
        raise MisfitError(f"{path} is not a diagnosis; write one with `misfit diagnose MODEL DATA --json {path}`")
    try:
        effects_of(document), document["model"], document["data"], document["verdict"]
    except (KeyError, TypeError, ValueError, AttributeError) as error:
        raise MisfitError(f"diagnosis {path} is damaged ({type(error).__name__}: {error}); write it again") from error
    return document


@click.command()
@click.argument("folder", default=RESULTS, metavar="[DIR]")
@json_option
@html_option
def ledger(folder: str, json_file: str | None, html_file: str | None) -> None:
    """List every version of a model: its effects, its errors, and how far they are from the noise floor."""
    from orchestrator.ledger import read
    from orchestrator.report.html import ledger_report
    from orchestrator.report.tables import LedgerTable

    entries = read(Path(folder))
    show(LedgerTable(entries), json_file == "-")
    write_json(json_file, {"schema": "misfit.ledger/1", "versions": [asdict(entry) for entry in entries]})
    write_file(html_file, ledger_report(entries) if html_file else None)


@click.command()
@click.argument("model")
@click.argument("data")
@library_option
@click.option(
    "--out",
    "folder",
    default=RESULTS,
    show_default=True,
    metavar="DIR",
    callback=can_be_filled,
    help="Models, FMUs and the ledger.",
)
@cards_option
@click.option(
    "--laws/--no-laws",
    default=None,
    help="Look for a formula of what no card explains; by default where the answer is unknown or leaves something open.",
)
@tolerance_option
@mend_option
@scheduler_option
@result_options()
def discover(
    model: str,
    data: str,
    folder: str,
    card_folders: tuple[Path, ...],
    laws: bool | None,
    tolerances: dict[str, float],
    accept_mends: bool,
    scheduler: str | None,
    json_file: str | None,
    html_file: str | None,
    quiet: bool,
    workers: int,
) -> None:
    """Compare MODEL with DATA, name the missing effects, add them, and compare again.

    Where no effect of the library explains all that is missing, formulas are proposed; their cards go to DIR/laws.
    """
    from orchestrator.discover import discover as run
    from orchestrator.greybox.laws import own_laws
    from orchestrator.library.cards import effect_library
    from orchestrator.measurements import load_measurements
    from orchestrator.model_argument import load_model, load_source
    from orchestrator.report.answer.formulas import formula_lines
    from orchestrator.report.arm_replay import arm_replay
    from orchestrator.report.html import discovery_report
    from orchestrator.report.tables import LedgerTable, diagnosis_table
    from orchestrator.understood import understood
    from orchestrator.work import resumable

    with progress(quiet) as say:
        say(f"reading {data}")
        cards = effect_library(card_folders)
        measurements = load_measurements(data).with_tolerances(tolerances)
        if accept_mends:
            measurements = mended_record(load_model(model), measurements, quiet)
        source = load_source(model, measurements)
        say("reading the model's equations")
        show("\n".join(understood(source, measurements)), quiet)
        with resumable(f"{model} {measurements.content_hash}", scheduler) as work:
            found = run(
                source,
                measurements,
                Path(folder),
                cards=cards,
                workers=workers,
                progress=say,
                work=work,
                laws=laws,
                own_laws=own_laws(card_folders),
            )
        report = None
        if html_file:
            replay = arm_replay(load_model(model), measurements, found.diagnosis.steps[0].comparison)
            report = discovery_report(found.diagnosis, list(found.entries), replay)
    show(diagnosis_table(found.diagnosis), quiet)
    document = found.diagnosis.to_json()
    if found.laws:
        show("\n".join(formula_lines(document)), quiet)
    show(LedgerTable(list(found.entries)), quiet)
    write_json(json_file, document)
    write_file(html_file, report)
