"""`misfit regress`."""

import sys
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from orchestrator.cli.common import progress, result_options, show, write_file, write_json

if TYPE_CHECKING:
    from orchestrator.regress.outcome import Outcome


@click.command()
@click.argument("paths", nargs=-1, metavar="[PATH]...")
@click.option("--update", is_flag=True, help="Write results that differ as the new references, and show what changed.")
@click.option("--junit", "junit_file", metavar="F", help="Write the outcomes to F as JUnit XML.")
@click.option("--github", is_flag=True, help="Print annotations for GitHub; on by itself in its workflows.")
@click.option("-k", "pattern", metavar="WORDS", help="Only cases whose name has all of these words.")
@result_options()
def regress(
    paths: tuple[str, ...],
    update: bool,
    junit_file: str | None,
    github: bool,
    pattern: str | None,
    json_file: str | None,
    html_file: str | None,
    quiet: bool,
    workers: int,
) -> None:
    """Run the regression cases of FMUs and systems: files NAME.regress.toml below each PATH (here, without any)."""
    from orchestrator.regress import outcome as outcomes_of
    from orchestrator.regress.collect import collect
    from orchestrator.regress.junit import junit
    from orchestrator.regress.pool import run_cases

    cases, broken = collect([Path(path) for path in paths] or [Path()])
    cases = [case for case in cases if all(word in case.name for word in (pattern or "").split())]
    with progress(quiet) as say:
        done: list[Outcome] = []

        def tell(outcome: "Outcome") -> None:
            done.append(outcome)
            say(f"{len(done)} of {len(cases)}: {outcome.name} {outcome.verdict}")

        outcomes = [*broken, *run_cases(cases, workers, tell, keep=update)]
    quiet = quiet or json_file == "-"
    if update:
        outcomes = _updated(cases, outcomes, quiet)
    show("\n".join(_lines(outcomes)), quiet)
    if github or _in_workflow():
        _annotate(outcomes)
    write_json(json_file, outcomes_of.document(outcomes))
    write_file(junit_file, junit(outcomes) if junit_file else None)
    if html_file:
        from orchestrator.regress.page import page

        write_file(html_file, page(outcomes))
    sys.exit(outcomes_of.exit_code(outcomes))


def _in_workflow() -> bool:
    import os

    return os.environ.get("GITHUB_ACTIONS") == "true"


def _annotate(outcomes: "Sequence[Outcome]") -> None:
    from orchestrator.regress.annotations import annotations

    for line in annotations(outcomes, Path()):
        click.echo(line, err=True)


def _updated(cases: Sequence[Any], outcomes: "Sequence[Outcome]", quiet: bool) -> "list[Outcome]":
    from orchestrator.regress.update import update_references

    after, changes = update_references(cases, outcomes)
    show("\n".join(changes) if changes else "no reference changed", quiet)
    return after


def _lines(outcomes: "Sequence[Outcome]") -> list[str]:
    from orchestrator.regress.junit import lines

    found = []
    for outcome in outcomes:
        if outcome.verdict == "passed":
            found.append(f"passed  {outcome.name} ({outcome.took_s:.2g} s)")
            continue
        first, *rest = lines(outcome)
        found.append(f"{outcome.verdict.upper():<7} {outcome.name}: {first}")
        found += [f"          {line}" for line in rest]
    counts = [(v, sum(o.verdict == v for o in outcomes)) for v in ("passed", "failed", "error")]
    found.append(", ".join(f"{count} {verdict}" for verdict, count in counts if count or verdict == "passed"))
    return found
