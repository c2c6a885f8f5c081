"""`--swap COMP=FMU`: the report of the interfaces, and the user's word where names are only similar."""

import sys
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from fmus.errors import MisfitError
from orchestrator.cli.common import write_file

if TYPE_CHECKING:
    from orchestrator.cosim.swap import SwapReport
    from orchestrator.cosim.system import System

Say = Callable[[str], None]


def with_swaps(
    system: "System", swaps: Sequence[str], mapping: str | None, agreed: bool, say: Say
) -> tuple["System", list[dict[str, Any]]]:
    """The system with other FMUs in it, and the reports as JSON, which are also said.

    Args:
        swaps: texts COMP=FILE.
        mapping: file with names; where it does not exist, it is written for the user to check.
        agreed: whether similar names are taken without asking.

    Raises:
        MisfitError: if a swap cannot work, or similar names are not confirmed; says why.
    """
    from orchestrator.cosim.swap import mapping_text, read_mapping, swap

    if mapping and not swaps:
        raise click.UsageError("--mapping FILE belongs to --swap COMP=FMU")
    known = mapping is not None and Path(mapping).exists()
    reports = []
    for text in swaps:
        name, equals, file = (part.strip() for part in text.partition("="))
        if not (equals and name and file):
            raise click.UsageError(f"--swap {text}: expected COMPONENT=FILE.fmu")
        found = swap(system, name, Path(file), read_mapping(Path(str(mapping)), name) if known else None)
        say(str(found.report))
        if mapping and not known:
            write_file(mapping, mapping_text(found.report))
            raise MisfitError(f"{mapping} did not exist and has been written; check its names and run again")
        if found.system is None:
            more = f" (and {len(found.report.problems) - 1} more)" if len(found.report.problems) > 1 else ""
            raise MisfitError(f"swap of {name} cannot work: {found.report.problems[0]}{more}")
        _confirm(found.report, agreed)
        system = found.system
        reports.append(found.report.to_json())
    return system, reports


def _confirm(report: "SwapReport", agreed: bool) -> None:
    if not report.questions or agreed:
        return
    pairs = ", ".join(f"{match.old} -> {match.new}" for match in report.questions)
    if sys.stdin.isatty() and click.confirm(f"take similar names of {report.component}: {pairs}?", err=True):
        return
    raise MisfitError(
        f"swap of {report.component} takes similar names: {pairs}; confirm with --yes, or say so in a file with --mapping FILE"
    )
