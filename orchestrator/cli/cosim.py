"""`misfit run`."""

import math
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from fmus.errors import MisfitError
from fmus.files import require_name_of_results
from orchestrator.cli.common import can_be_written, on_screen, show, write_json
from orchestrator.cli.running import full_address, options_of, running_options
from orchestrator.cli.swaps import with_swaps

if TYPE_CHECKING:
    from orchestrator.cosim.run import RunOptions, RunOutcome
    from orchestrator.cosim.summary import SummaryRecorder
    from orchestrator.cosim.system import System
    from orchestrator.results import ResultComparison

Watch = Callable[[float], None]


@click.command()
@click.argument("model", metavar="SYSTEM")
@click.option(
    "--out", metavar="F", callback=can_be_written, help="Results: .parquet (also without an ending), .csv, .h5 or .mf4."
)
@click.option(
    "--set", "values", multiple=True, metavar="COMP.VAR=VALUE", help="Parameter or start value, such as m=2.5 kg."
)
@click.option("--swap", "swaps", multiple=True, metavar="COMP=FMU", help="Use another FMU for a component.")
@click.option("--mapping", metavar="FILE", help="Names of a swapped FMU's variables; written where there is none.")
@click.option("--yes", "agreed", is_flag=True, help="Take similar names of a swapped FMU without asking.")
@click.option(
    "--excite",
    is_flag=True,
    help="Move each input that nothing drives within its declared range, as the FMU before a --swap declares it.",
)
@click.option("--against", metavar="RESULT", help="Compare with the results of an earlier run.")
@click.option("--realtime", type=float, metavar="FACTOR", help="Keep pace with the clock, FACTOR times as fast.")
@click.option(
    "--nan",
    "not_finite",
    multiple=True,
    metavar="PATTERN=POLICY",
    help="Outputs that are not finite numbers: stop (the default), hold the last finite value, or warn.",
)
@running_options
def run(
    model: str,
    out: str | None,
    values: tuple[str, ...],
    swaps: tuple[str, ...],
    mapping: str | None,
    agreed: bool,
    excite: bool,
    against: str | None,
    realtime: float | None,
    not_finite: tuple[str, ...],
    json_file: str | None,
    quiet: bool,
    trusted: bool,
    **given: Any,
) -> None:
    """Run SYSTEM: a system file (.toml, .ssd, .ssp), an .fmu, FILE.mo:Package.Class, or a built-in model."""
    from orchestrator.cli import run_text
    from orchestrator.cli.excite import excited as with_moving_inputs
    from orchestrator.cli.excite import without_drive
    from orchestrator.cosim.load import load_system
    from orchestrator.cosim.run import run_system, trust_all
    from orchestrator.cosim.summary import SummaryRecorder
    from orchestrator.results import MemoryRecorder, Nowhere, compare_results, read_result, recorder_for

    say = partial(show, quiet=quiet or json_file == "-")
    earlier = read_result(against) if against else None
    system = with_policies(with_settings(load_system(model), values), not_finite)
    excited: list[str] = []
    if excite:
        system, excited = with_moving_inputs(system, given["stop"])
        say(f"excited: {', '.join(excited) or 'nothing, every input that is a number is driven or has a value'}")
    system, swapped = with_swaps(system, swaps, mapping, agreed, say)
    if trusted:
        trust_all(system)
    target = out_path(out)
    onward = recorder_for(target) if target else MemoryRecorder() if earlier else Nowhere()
    summary = SummaryRecorder(onward)
    options = options_of(given, realtime)
    try:
        with moving_bar(system, options, quiet) as watch:
            outcome = run_system(system, summary, options, watch)
    except MisfitError as error:
        raise kept(error, onward) from error
    found = None
    if earlier is not None:
        now = onward.result() if isinstance(onward, MemoryRecorder) else read_result(str(target))
        found = without_drive(compare_results(earlier, now))
    for line in (*run_text.head(system, outcome), *run_text.table(summary), *run_text.speed(outcome)):
        say(line)
    if target:
        say(f"results: {target} ({summary.count} rows, {len(summary.columns)} columns)")
    for line in run_text.differences(found, str(against)) if found else ():
        say(line)
    write_json(json_file, document(model, outcome, summary, target, swapped, found, excited))


def with_settings(system: "System", values: tuple[str, ...]) -> "System":
    """The system with values from the command line; a system of one component needs no name before the variable."""
    from orchestrator.cosim.system import Value

    found = {}
    for text in values:
        address, equals, value = text.partition("=")
        if not equals:
            raise click.UsageError(f"--set {text}: expected COMPONENT.VARIABLE=VALUE, such as mass.m=2.5")
        found[full_address(system, address.strip())] = Value(value.strip())
    return system.with_values(found)


def with_policies(system: "System", given: tuple[str, ...]) -> "System":
    """The system with what to do about values that are not finite, from the command line."""
    from dataclasses import replace

    found = dict(system.run.nan)
    for text in given:
        pattern, equals, policy = text.rpartition("=")
        if not equals:
            raise click.UsageError(f"--nan {text}: expected PATTERN=POLICY, such as 'crane.*=hold'")
        found.pop(full_address(system, pattern), None)  # the last word counts
        found[full_address(system, pattern)] = policy
    return replace(system, run=replace(system.run, nan=found)) if given else system


def out_path(out: str | None) -> Path | None:
    """Where results go; Parquet where the name has no ending."""
    if out is None:
        return None
    path = Path(out)
    require_name_of_results(path)
    return path if path.suffix else path.with_name(path.name + ".parquet")


def kept(error: MisfitError, recorder: object) -> MisfitError:
    """The error, with where the results until then are."""
    from orchestrator.results.file_recorder import FileRecorder

    if not isinstance(recorder, FileRecorder):
        return error
    count, place = recorder.kept
    return type(error)(f"{error}; {count} rows until then are in {place}") if count else error


@contextmanager
def moving_bar(system: "System", options: "RunOptions", quiet: bool) -> Iterator[Watch | None]:
    """A bar over simulated time with the real-time factor, on a terminal only."""
    stop = system.run.stop if options.stop is None else options.stop
    if quiet or stop is None or not sys.stderr.isatty():
        yield None
        return
    from rich.console import Console
    from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn, TimeRemainingColumn

    start, began, shown = system.run.start or 0.0, time.perf_counter(), [0.0]
    columns = (TextColumn("{task.description}", markup=False), BarColumn(), TimeElapsedColumn(), TimeRemainingColumn())
    with on_screen(Progress(*columns, console=Console(stderr=True), transient=True)) as bar:
        task = bar.add_task("preparing", total=stop - start if math.isfinite(stop) else None)

        def watch(simulated: float) -> None:
            now = time.perf_counter()
            if now - shown[0] < 0.1:  # drawing more often costs more than the run
                return
            shown[0] = now
            factor = (simulated - start) / (now - began)
            bar.update(
                task, completed=simulated - start, description=f"t = {simulated:.6g} s, {factor:.3g} x real time"
            )

        yield watch


def document(
    model: str,
    outcome: "RunOutcome",
    summary: "SummaryRecorder",
    target: Path | None,
    swapped: list[Any],
    found: "ResultComparison | None",
    excited: list[str],
) -> dict[str, Any]:
    """The run as JSON."""
    report = outcome.report
    return {
        "schema": "misfit.run/1",
        "model": model,
        "start": outcome.start,
        "end": outcome.end,
        "stop": outcome.stop,
        "step": outcome.step,
        "seconds": outcome.seconds,
        "seconds_to_prepare": outcome.preparing,
        "realtime_factor": (outcome.end - outcome.start) / outcome.seconds,
        "isolated": outcome.isolated,
        "ended": outcome.ended,
        "conversions": list(report.conversions),
        "unconnected": list(report.unconnected),
        "delays": list(report.delays),
        "loops": list(report.loops),
        "together": list(report.together),
        "compiled": not report.engine,
        "in_python": report.engine,
        "signals": summary.to_json(),
        "results": str(target) if target else None,
        "swaps": swapped,
        "against": found.to_json() if found else None,
        "realtime": outcome.lateness.to_json() if outcome.lateness else None,
        "provenance": dict(outcome.provenance),
        "not_finite": {name: vars(noted) for name, noted in report.not_finite.items()},
        "excited": excited,
    }
