"""`misfit regress`, and its `trend` and `bisect`."""

import os
import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from fmus.errors import MisfitError
from orchestrator.cli.common import (
    can_be_filled,
    can_be_written,
    html_option,
    json_option,
    progress,
    quiet_option,
    show,
    write_file,
    write_json,
)

if TYPE_CHECKING:
    from orchestrator.regress.case import Case
    from orchestrator.regress.outcome import Outcome


Command = Callable[..., None]
_MOST_LINES = 20  # of a case, on the terminal


def _common(command: Command) -> Command:
    return quiet_option(json_option(command))


class WithPaths(click.Group):
    """A group that takes what is none of its commands for paths of cases; a folder of a command's name goes first."""

    def parse_args(self, ctx: click.Context, args: list[str]) -> list[str]:
        """Put the command for cases before paths and options."""
        if not args or args[0] not in self.commands or Path(args[0]).exists():
            args = ["cases", *args]
        return super().parse_args(ctx, args)


@click.group(cls=WithPaths, add_help_option=False)
def regress() -> None:
    """Run the regression cases of FMUs and systems."""


@regress.command(name="cases")
@click.argument("paths", nargs=-1, metavar="[PATH]...")
@click.option("--update", is_flag=True, help="Write results that differ as the new references, and show what changed.")
@click.option(
    "--junit", "junit_file", metavar="F", callback=can_be_written, help="Write the outcomes to F as JUnit XML."
)
@click.option("--github", is_flag=True, help="Print annotations for GitHub; on by itself in its workflows.")
@click.option(
    "-k", "pattern", metavar="WORDS", default="", help="Only cases whose names or tags have all of these words."
)
@click.option(
    "--history",
    metavar="DIR",
    callback=can_be_filled,
    help="Add the outcomes to the history in DIR, for misfit regress trend.",
)
@click.option("--coverage", is_flag=True, help="Say which states, branches and ranges the cases reach.")
@click.option("--suggest", is_flag=True, help="Propose cases that reach what is not covered; implies --coverage.")
@html_option
@_common
@click.option(
    "--workers", type=click.IntRange(1, 64), default=os.cpu_count() or 1, show_default=True, help="Processes."
)
def cases_command(
    paths: tuple[str, ...],
    update: bool,
    junit_file: str | None,
    github: bool,
    pattern: str,
    history: str | None,
    coverage: bool,
    suggest: bool,
    json_file: str | None,
    html_file: str | None,
    quiet: bool,
    workers: int,
) -> None:
    """Run the cases in the files NAME.regress.toml below each PATH (here, without any): has the behaviour changed?

    misfit regress trend HISTORY and misfit regress bisect FOLDER CASE look back; each has --help.
    """
    from orchestrator.regress import outcome as outcomes_of
    from orchestrator.regress.junit import junit

    cases, broken = _collected(paths, pattern)
    quiet = quiet or json_file == "-"
    outcomes = [*broken, *_run(cases, workers, quiet, "signals" if update else "verdict")]
    if update:
        outcomes = _updated(cases, outcomes, quiet)
    show("\n".join(_lines(outcomes)), quiet)
    document = outcomes_of.document(outcomes)
    if coverage or suggest:
        document["coverage"] = _covered(cases, workers, quiet, suggest)
    if github or os.environ.get("GITHUB_ACTIONS") == "true":
        _annotate(outcomes)
    if history:
        from orchestrator.regress.history import append

        append(Path(history), outcomes)
    write_json(json_file, document)
    write_file(junit_file, junit(outcomes) if junit_file else None)
    if html_file:
        from orchestrator.regress.page import page

        write_file(html_file, page(outcomes))
    sys.exit(outcomes_of.exit_code(outcomes))


@regress.command()
@click.argument("folder", metavar="HISTORY")
@html_option
@_common
def trend(folder: str, json_file: str | None, html_file: str | None, quiet: bool) -> None:
    """Show the runs that --history kept in HISTORY: how near each signal came to its limit, and what each case costs."""
    from orchestrator.measurements.wording import counted
    from orchestrator.regress.history import read, trend_of, trend_page

    found = trend_of(read(Path(folder)))
    lines = [
        f"{counted(len(found.runs), 'run')} of {counted(len(found.verdicts), 'case')}, {found.runs[0]} to {found.runs[-1]}"
    ]
    for name, verdicts in found.verdicts.items():
        lines.append(f"{''.join(v[:1].upper() if v != 'passed' else '.' for v in verdicts if v):<20} {name}")
    lines += [f"drifting: {x.case}: {x.signal}, by {x.drift:.2g} of its tolerance" for x in found.drifting]
    show("\n".join(lines), quiet or json_file == "-")
    write_json(json_file, found.to_json())
    write_file(html_file, trend_page(found, folder) if html_file else None)


@regress.command()
@click.argument("folder", metavar="FOLDER")
@click.argument("case_file", metavar="CASE")
@click.option("-k", "pattern", metavar="WORDS", default="", help="Which case of the file, where it has several.")
@_common
def bisect(folder: str, case_file: str, pattern: str, json_file: str | None, quiet: bool) -> None:
    """Find the first FMU of FOLDER, versions of one, that does not pass CASE (a case file), and the signal that differs.

    The exit code is 1 if one differs.
    """
    from orchestrator.regress.bisect import bisect as search
    from orchestrator.regress.bisect import versions_in

    cases, broken = _collected((case_file,), pattern)
    if broken:
        raise MisfitError(broken[0].reason)
    if len(cases) != 1:
        names = ", ".join(case.name for case in cases) or "none"
        raise MisfitError(f"{case_file} has {len(cases)} cases to choose from ({names}); name one with -k")
    with _one_lane(quiet) as run:
        found = search(cases[0], versions_in(Path(folder)), run)
    show(found.words, quiet or json_file == "-")
    write_json(json_file, found.to_json())
    sys.exit(0 if found.first is None else 1)


def _collected(paths: Sequence[str], pattern: str) -> "tuple[list[Case], list[Outcome]]":
    from orchestrator.regress.collect import collect

    cases, broken = collect([Path(path) for path in paths] or [Path()])
    words = pattern.split()
    return [case for case in cases if all(word in " ".join((case.name, *case.tags)) for word in words)], broken


def _run(cases: "Sequence[Case]", workers: int, quiet: bool, want: Any) -> "list[Outcome]":
    from orchestrator.regress.pool import run_cases

    done: list[Outcome] = []
    with progress(quiet) as say:

        def tell(outcome: "Outcome") -> None:
            done.append(outcome)
            say(f"{len(done)} of {len(cases)}: {outcome.name} {outcome.verdict}")

        return run_cases(cases, workers, tell, want)


@contextmanager
def _one_lane(quiet: bool) -> Iterator[Any]:
    from orchestrator.regress.pool import Lane

    lane = Lane()
    with progress(quiet) as say:

        def run(case: "Case") -> "Outcome":
            say(Path(case.model).name)
            return lane.run(case)

        try:
            yield run
        finally:
            lane.close()


def _covered(cases: "Sequence[Case]", workers: int, quiet: bool, suggest: bool) -> list[dict[str, Any]]:
    """Coverage of each model, with proposals where they are asked for."""
    from orchestrator.regress import outcome as outcomes_of
    from orchestrator.regress.coverage import cover, coverage_lines

    def run(some: "Sequence[Case]") -> "list[Outcome]":
        return _run(some, workers, quiet, "coverage")

    models = cover(cases, run(cases))
    found = []
    for model in models:
        document = model.to_json()
        show("\n".join(coverage_lines(model)), quiet)
        if suggest:
            from orchestrator.regress.suggest import suggestions

            proposed = suggestions(model, run)
            document["suggestions"] = [each.to_json() for each in proposed]
            show("\n".join(each.text for each in proposed) or "  nothing was found that reaches more", quiet)
        found.append(outcomes_of.plain(document))
    return found


def _annotate(outcomes: "Sequence[Outcome]") -> None:
    from orchestrator.regress.junit import annotations

    for line in annotations(outcomes, Path()):
        click.echo(line, err=True)


def _updated(cases: "Sequence[Case]", outcomes: "Sequence[Outcome]", quiet: bool) -> "list[Outcome]":
    from orchestrator.regress.update import update_references

    after, changes = update_references(cases, outcomes)
    show("\n".join(changes) if changes else "no reference changed", quiet)
    return after


def _with_folder(outcome: "Outcome") -> str:
    """Name of a case with the folder of its file, as seen from here: teams have many cases called `start`."""
    folder = os.path.relpath(Path(outcome.file).parent)
    return outcome.name if folder == "." else f"{folder}/{outcome.name}"


def _lines(outcomes: "Sequence[Outcome]") -> list[str]:
    from orchestrator.regress.junit import lines

    found = []
    for outcome in outcomes:
        name = _with_folder(outcome)
        if outcome.verdict == "passed":
            found.append(f"passed  {name} ({outcome.took_s:.2g} s)")
            continue
        first, *rest = lines(outcome)
        found.append(f"{outcome.verdict.upper():<7} {name}: {first}")
        found += [f"          {line}" for line in rest[:_MOST_LINES]]
        if len(rest) > _MOST_LINES:
            found.append(f"          ... and {len(rest) - _MOST_LINES} more; --json F has them all")
    counts = [(v, sum(o.verdict == v for o in outcomes)) for v in ("passed", "failed", "error")]
    found.append(", ".join(f"{count} {verdict}" for verdict, count in counts if count or verdict == "passed"))
    return found
