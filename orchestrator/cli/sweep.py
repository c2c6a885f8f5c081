"""`misfit sweep`."""

import math
import os
import sys
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import click

from orchestrator.cli.common import can_be_filled, on_screen, show, write_json
from orchestrator.cli.running import full_address, options_of, running_options


@click.command()
@click.argument("model", metavar="SYSTEM")
@click.option(
    "--out",
    required=True,
    metavar="DIR",
    callback=can_be_filled,
    help="Folder of the data set; a study that was stopped goes on.",
)
@click.option(
    "--set", "values", multiple=True, metavar="COMP.VAR=VALUES", help="a,b,c or linspace(a,b,n) or logspace(a,b,n)."
)
@click.option("--seeds", metavar="N|a,b,c", help="Seeds 0 to N-1, or these, for every parameter called seed.")
@click.option("--swap", "swaps", multiple=True, metavar="COMP=FMU,FMU", help="FMUs to use for a component.")
@click.option(
    "--workers", type=click.IntRange(1, 256), default=os.cpu_count() or 1, show_default=True, help="Runs at a time."
)
@click.option("--scheduler", metavar="ADDRESS", help="Run on the Dask cluster at ADDRESS, such as tcp://host:8786.")
@running_options
def sweep(
    model: str,
    out: str,
    values: tuple[str, ...],
    seeds: str | None,
    swaps: tuple[str, ...],
    workers: int,
    scheduler: str | None,
    json_file: str | None,
    quiet: bool,
    trusted: bool,
    **given: Any,
) -> None:
    """Run SYSTEM with every combination of values, seeds and FMUs, into one Parquet data set."""
    from orchestrator.cli import run_text
    from orchestrator.cosim.load import load_system
    from orchestrator.cosim.run import trust_all
    from orchestrator.cosim.sweep import Study, cases_of, parse_values

    system = load_system(model)
    if trusted:
        trust_all(system)
    varied = {full_address(system, name): parse_values(text) for name, text in pairs("--set", values)}
    fmus = {name: parse_values(text) for name, text in pairs("--swap", swaps)}
    cases = cases_of(varied, seeds_of(seeds), fmus)
    study = Study(system, cases, options_of(given), Path(out))
    began = time.perf_counter()
    with counting_bar(quiet) as progress:
        outcome = study.run(workers, scheduler, progress)
    seconds = time.perf_counter() - began
    if not quiet and json_file != "-":
        for line in run_text.study(outcome, seconds, out):
            show(line, False)
    done = [{**vars(run), "varied": case.words} for run, case in zip(outcome.runs, cases, strict=True)]
    about = {"schema": "misfit.sweep/1", "model": model, "out": out, "seconds": seconds}
    write_json(json_file, finite({**about, "done_before": outcome.done_before, "runs": done}))
    if outcome.failed:
        sys.exit(3)


def pairs(option: str, texts: tuple[str, ...]) -> Iterator[tuple[str, str]]:
    """Names and values of NAME=VALUES."""
    for text in texts:
        name, equals, values = (part.strip() for part in text.partition("="))
        if not (name and equals and values):
            raise click.UsageError(f"{option} {text}: expected NAME=VALUES, such as mass.m=1,2,3")
        yield name, values


def seeds_of(text: str | None) -> list[int]:
    """Seeds of `N` or `a,b,c`."""
    if text is None:
        return []
    try:
        numbers = [int(part) for part in text.split(",")]
    except ValueError:
        raise click.UsageError(f"--seeds {text}: expected a number of seeds, or seeds with commas") from None
    return numbers if len(numbers) > 1 else list(range(numbers[0]))


@contextmanager
def counting_bar(quiet: bool) -> Iterator[Callable[[int, int], None] | None]:
    """A bar over runs, on a terminal only."""
    if quiet or not sys.stderr.isatty():
        yield None
        return
    from rich.console import Console
    from rich.progress import Progress

    with on_screen(Progress(console=Console(stderr=True), transient=True)) as bar:
        task = bar.add_task("runs", total=None)
        yield lambda done, total: bar.update(task, completed=done, total=total)


def finite(value: Any) -> Any:
    """The same document with None where a number is not finite: JSON has no such numbers."""
    if isinstance(value, Mapping):
        return {name: finite(part) for name, part in value.items()}
    if isinstance(value, list | tuple):
        return [finite(part) for part in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value
