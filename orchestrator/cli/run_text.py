"""A run in plain lines: does it fit, what came out, how fast it was, what differs."""

import math
from collections.abc import Iterator, Sequence

from orchestrator.cosim.run import RunOutcome
from orchestrator.cosim.summary import SummaryRecorder
from orchestrator.cosim.sweep.study import StudyOutcome
from orchestrator.cosim.system import System
from orchestrator.results.compare import ResultComparison

MOST_LINES = 12


def head(system: System, outcome: RunOutcome) -> Iterator[str]:
    """What was run, how it was wired, and whether it went to its end."""
    step = "steps as the master chooses" if outcome.step is None else f"steps of {outcome.step:g} s"
    parts = f"{len(system.components)} component{'s' if len(system.components) > 1 else ''}"
    joined = f"{len(system.connections)} connection{'s' if len(system.connections) != 1 else ''}"
    yield f"{system.name}: {parts}, {joined}, master {outcome.provenance['master']}, {step}"
    yield from _some(outcome.report.lines)
    if outcome.report.engine:
        yield f"not in the compiled loop: {outcome.report.engine}"
    if outcome.isolated:
        yield "ran in a process of its own (FMUs of others; --trust them, or --no-isolate)"
    if outcome.ended:
        yield outcome.ended


def table(summary: SummaryRecorder) -> Iterator[str]:
    """First, last, smallest and largest value of each signal."""
    if not summary.columns:
        yield "no numbers to record"
        return
    rows: list[tuple[str, ...]] = [("signal", "unit", "first", "last", "smallest", "largest")]
    parts = zip(summary.columns, summary.first, summary.last, summary.smallest, summary.largest, strict=True)
    for column, *values in list(parts)[:MOST_LINES]:
        rows.append((column.name, column.unit, *(f"{value + 0.0:.6g}" for value in values)))  # no -0
    yield from _aligned(rows)
    if len(summary.columns) > MOST_LINES:
        yield f"... and {len(summary.columns) - MOST_LINES} more; --record PATTERN chooses"


def speed(outcome: RunOutcome) -> Iterator[str]:
    """How long it took, and how late it was if it was paced."""
    simulated = outcome.end - outcome.start
    count = math.ceil(simulated / outcome.step - 1e-6) if outcome.step else 0
    points = f"{count} steps, " if count else ""
    each = f", {1e6 * outcome.seconds / count:.3g} us a step" if count else ""
    factor = simulated / outcome.seconds if outcome.seconds else 0.0
    yield (
        f"{points}{outcome.start:g} to {outcome.end:g} s in {outcome.seconds:.3g} s: {factor:.3g} times real time{each}"
        f" ({outcome.preparing:.2g} s to prepare)"
    )
    late = outcome.lateness
    if late is not None:
        yield (
            f"paced at {late.factor:g} times real time: {late.missed} of {late.points} points missed, lateness "
            f"p50 {1e6 * late.p50:.0f} us, p99 {1e6 * late.p99:.0f} us, max {1e6 * late.largest:.0f} us"
        )


def differences(found: ResultComparison, against: str) -> Iterator[str]:
    """What differs from another result, signal by signal."""
    yield f"against {against}, {found.start:g} to {found.stop:g} s:"
    rows = [("signal", "unit", "largest", "at s", "rms", "of its range", "parts at s")]
    for s in found.signals[:MOST_LINES]:
        share = f"{100 * s.largest / s.spread:.3g} %" if s.spread else "-"
        parted = "never" if s.parted_at is None else f"{s.parted_at:.6g}"
        rows.append((s.name, s.unit, f"{s.largest:.3g}", f"{s.largest_at:.6g}", f"{s.rms:.3g}", share, parted))
    yield from _aligned(rows)
    if len(found.signals) > MOST_LINES:
        yield f"... and {len(found.signals) - MOST_LINES} more that differ less"
    if found.only_first:
        yield f"only in {against}: {', '.join(found.only_first)}"
    if found.only_second:
        yield f"only in this run: {', '.join(found.only_second)}"
    if found.signals and not found.exercised:
        yield (
            "nothing was exercised: no signal moved in either run, so it is not known whether "
            "they agree; move the inputs, as --excite does in both"
        )
    elif found.same:
        yield f"no signal parts by more than {found.tolerance:g} of its range"


def study(outcome: StudyOutcome, seconds: float, out: str) -> Iterator[str]:
    """How many runs there were, and which failed."""
    now = len(outcome.runs) - outcome.done_before
    before = f", {outcome.done_before} were done before" if outcome.done_before else ""
    rate = f", {now / seconds:.3g} a second" if now and seconds else ""
    yield f"{len(outcome.runs)} runs: {now} in {seconds:.3g} s{rate}{before}; data set {out}, table of runs {out}/_runs.parquet"
    yield from _some([f"run {run.number} failed: {run.failure}" for run in outcome.failed])


def _some(lines: Sequence[str]) -> Iterator[str]:
    yield from lines[:MOST_LINES]
    if len(lines) > MOST_LINES:
        yield f"... and {len(lines) - MOST_LINES} more; --json has them all"


def _aligned(rows: Sequence[Sequence[str]]) -> Iterator[str]:
    """Names to the left, numbers to the right."""
    widths = [max(len(row[k]) for row in rows) for k in range(len(rows[0]))]
    for row in rows:
        cells = [
            cell.ljust(width) if k < 2 else cell.rjust(width)
            for k, (cell, width) in enumerate(zip(row, widths, strict=True))
        ]
        yield "  " + "  ".join(cells).rstrip()
