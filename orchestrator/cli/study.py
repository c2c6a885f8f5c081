"""`misfit study`."""

import time
from typing import Any

import click

from orchestrator.cli.common import progress, result_options, scheduler_option, show, write_file, write_json


@click.group()
def study() -> None:
    """Studies that can be repeated from nothing."""


@study.command()
@click.option("--draws", type=click.IntRange(2, 1_000_000), default=4096, show_default=True, help="Draws of each size.")
@click.option("--seed", type=click.IntRange(0, 2**31), default=1, show_default=True, help="First of the seeds.")
@click.option("--seeds", type=click.IntRange(1, 100), default=10, show_default=True, help="How many seeds.")
@click.option(
    "--caregivers", "people", type=click.IntRange(1, 100), default=8, show_default=True, help="How many caregivers."
)
@click.option("--recorded", metavar="DIR", multiple=True, type=click.Path(exists=True, file_okay=False),
              help="Corrections of a session of misfit hil record, through the bus, instead of simulated ones; "
              "repeat for more caregivers.")  # fmt: skip
@scheduler_option
@result_options()
def caregivers(
    draws: int,
    seed: int,
    seeds: int,
    people: int,
    recorded: tuple[str, ...],
    scheduler: str | None,
    workers: int,
    quiet: bool,
    json_file: str | None,
    html_file: str | None,
) -> None:
    """Eight virtual caregivers hold an arm: what do its muscle models learn from their corrections?"""
    from orchestrator.study.document import document
    from orchestrator.study.study import run_study
    from orchestrator.study.work import working

    if recorded:
        _recorded(recorded, seed, quiet, json_file, html_file)
        return
    began = time.perf_counter()
    chosen = tuple(range(seed, seed + seeds))
    name = f"study caregivers {draws} {people} {chosen}"
    with progress(quiet) as say, working(name, workers, scheduler) as work:
        found = run_study(chosen, draws, people, work, say)
    seconds = time.perf_counter() - began
    write_json(json_file, document(found, seconds))
    if html_file is not None:
        from orchestrator.study.report import study_report

        write_file(html_file, study_report(found, seconds))
    if json_file != "-":
        _print(found, quiet)


def _recorded(folders: tuple[str, ...], seed: int, quiet: bool, json_file: str | None, html_file: str | None) -> None:
    """The same from recorded sessions: one table."""
    from orchestrator.study.recorded import rows_of, study_of
    from orchestrator.study.tables import SHORT

    if html_file is not None:
        raise click.UsageError("--html draws the simulated study; with --recorded use --json")
    with progress(quiet) as say:
        found = study_of(folders, seed, say)
    write_json(json_file, found)
    if json_file == "-" or quiet:
        return
    show(
        f"{found['corrections']} corrections of {len(folders)} recorded sessions; improvement in % of the error of each muscle's "
        "model; inside: share in % of forces inside 90 % intervals predicted without their trial",
        quiet,
    )
    _show_table(None, ("way to learn", "used", *SHORT, "inside"), rows_of(found), quiet)


def _show_table(caption: str | None, headings: tuple[str, ...], rows: Any, quiet: bool) -> None:
    from rich.box import SIMPLE_HEAD
    from rich.table import Table

    table = Table(title=caption, box=SIMPLE_HEAD, title_justify="left", title_style="bold", padding=(0, 1, 0, 0))
    for place, heading in enumerate(headings):
        table.add_column(heading, no_wrap=place > 0 or len(headings) > 5)
    for row in rows:
        table.add_row(*row)
    show(table, quiet)


def _print(found: Any, quiet: bool) -> None:
    if quiet:
        return
    from orchestrator.study.study import GROWTHS, LIMITS
    from orchestrator.study.tables import bars_table, growth_table, regression_table, sentence, variants_table

    show(sentence(found), quiet)
    parts = [
        regression_table(found),
        *(growth_table(found, *way) for way in GROWTHS),
        *(variants_table(found, "small", limit) for limit in LIMITS),
        bars_table(found),
    ]
    for part in parts:
        _show_table(part.caption, part.headings, part.rows, quiet)
