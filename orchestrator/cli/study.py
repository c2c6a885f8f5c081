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
@scheduler_option
@result_options()
def caregivers(
    draws: int,
    seed: int,
    seeds: int,
    people: int,
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


def _print(found: Any, quiet: bool) -> None:
    if quiet:
        return
    from rich.box import SIMPLE_HEAD
    from rich.table import Table

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
        table = Table(
            title=part.caption, box=SIMPLE_HEAD, title_justify="left", title_style="bold", padding=(0, 1, 0, 0)
        )
        for place, heading in enumerate(part.headings):
            table.add_column(heading, no_wrap=place > 0 or len(part.headings) > 5)
        for row in part.rows:
            table.add_row(*row)
        show(table, quiet)
