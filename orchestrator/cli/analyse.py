"""`misfit compare` and `misfit diagnose`."""

from pathlib import Path

import click

from orchestrator.cli.common import (
    can_be_written,
    cards_option,
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


@click.command()
@click.argument("model")
@click.argument("data")
@library_option
@mend_option
@result_options()
def compare(
    model: str,
    data: str,
    accept_mends: bool,
    json_file: str | None,
    html_file: str | None,
    quiet: bool,
    workers: int,
) -> None:
    """Show where MODEL fails against DATA, and by how much, against the noise floor."""
    from orchestrator.compare.comparison import compare as run
    from orchestrator.measurements import load_measurements
    from orchestrator.model_argument import load_model
    from orchestrator.report.arm_replay import arm_replay
    from orchestrator.report.html import comparison_report
    from orchestrator.report.tables import comparison_table

    with progress(quiet) as say:
        say(f"reading {data}")
        measurements = load_measurements(data)
        say(f"building {model}")
        loaded = load_model(model)
        if accept_mends:
            measurements = mended_record(loaded, measurements, quiet)
        say("running the model along every trial")
        result = run(loaded, measurements, workers=workers)
        report = comparison_report(result, arm_replay(loaded, measurements, result)) if html_file else None
    show(comparison_table(result), quiet)
    show("\n".join((*result.findings, *map(str, result.data_checks))), quiet)
    write_json(json_file, result.to_json())
    write_file(html_file, report)


@click.command()
@click.argument("model")
@click.argument("data")
@library_option
@cards_option
@tolerance_option
@mend_option
@scheduler_option
@click.option(
    "--experiment",
    "experiment_file",
    metavar="F",
    callback=can_be_written,
    help="Write the inputs of the next experiment to F (CSV).",
)
@result_options()
def diagnose(
    model: str,
    data: str,
    card_folders: tuple[Path, ...],
    tolerances: dict[str, float],
    accept_mends: bool,
    scheduler: str | None,
    experiment_file: str | None,
    json_file: str | None,
    html_file: str | None,
    quiet: bool,
    workers: int,
) -> None:
    """Name the physical effect that MODEL lacks to explain DATA."""
    from orchestrator.diagnose import diagnose as run
    from orchestrator.greybox.laws import own_laws
    from orchestrator.library.cards import effect_library
    from orchestrator.measurements import load_measurements
    from orchestrator.model_argument import load_model, load_source
    from orchestrator.report.arm_replay import arm_replay
    from orchestrator.report.html import diagnosis_report
    from orchestrator.report.tables import diagnosis_table
    from orchestrator.work import resumable

    with progress(quiet) as say:
        say(f"reading {data}")
        cards = effect_library(card_folders)
        measurements = load_measurements(data).with_tolerances(tolerances)
        if accept_mends:
            measurements = mended_record(load_model(model), measurements, quiet)
        source = load_source(model, measurements)
        with resumable(f"{model} {measurements.content_hash}", scheduler) as work:
            own = own_laws(card_folders)
            result = run(source, measurements, cards=cards, workers=workers, progress=say, work=work, laws=own)
        given = result.steps[0].comparison
        report = diagnosis_report(result, arm_replay(load_model(model), measurements, given)) if html_file else None
    show(diagnosis_table(result), quiet)
    if experiment_file is not None and result.experiment_csv is None:
        show(
            f"{experiment_file} is not written: nothing is left open that an experiment of the menu would settle", quiet
        )
    write_file(experiment_file, result.experiment_csv)
    write_json(json_file, result.to_json())
    write_file(html_file, report)
