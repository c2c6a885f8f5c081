"""What `misfit run` and `misfit sweep` have in common."""

import math
from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any

import click

from orchestrator.cli.common import json_option, quiet_option

if TYPE_CHECKING:
    from orchestrator.cosim.run import RunOptions
    from orchestrator.cosim.system import System

Decorator = Callable[[Callable[..., None]], Callable[..., None]]


def running_options(command: Callable[..., None]) -> Callable[..., None]:
    """Add what `run` and `sweep` have in common."""
    master = "ordered, jacobi, gauss_seidel, iterative or adaptive"
    options: tuple[Decorator, ...] = (
        click.option("--stop", type=float, metavar="T", help="Simulated time at the end in s; inf: until Ctrl-C."),
        click.option("--step", type=float, metavar="H", help="Communication step in s."),
        click.option("--master", metavar="KIND", help=f"How components are coupled: {master}."),
        click.option("--tolerance", type=float, metavar="TOL", help="Relative tolerance for FMUs and masters."),
        click.option(
            "--record", multiple=True, metavar="PATTERN", help="Record these, such as 'arm.*'; all outputs else."
        ),
        click.option("--every", type=click.IntRange(1), default=1, metavar="N", help="Record each N-th point."),
        click.option(
            "--isolate/--no-isolate", default=None, help="Run in a process of its own; else only FMUs of others."
        ),
        click.option("--patience", type=float, default=60.0, metavar="S", help="Silence of an isolated FMU in s."),
        click.option("--memory", type=float, default=4.0, metavar="GIB", help="Memory of an isolated run in GiB."),
        click.option("--trust", "trusted", is_flag=True, help="Trust the FMUs of this system from now on."),
        json_option,
        quiet_option,
    )
    for option in reversed(options):
        command = option(command)
    return command


def options_of(given: Mapping[str, Any], realtime: float | None = None) -> "RunOptions":
    """Options of the command line as those of a run."""
    from orchestrator.cosim.isolate.process import ChildLimits
    from orchestrator.cosim.run import RunOptions

    for name, what in (
        ("step", "a time in s"),
        ("patience", "a time in s"),
        ("memory", "GiB"),
        ("tolerance", "a share"),
    ):
        value = given[name]
        if value is not None and not 0.0 < value < math.inf:
            raise click.UsageError(f"--{name} {value:g}: expected {what} above zero")
    return RunOptions(
        **{name: given[name] for name in ("stop", "step", "master", "tolerance", "every", "isolate")},
        record=tuple(given["record"]) or None,
        limits=ChildLimits(given["patience"], given["memory"]),
        realtime=realtime,
    )


def full_address(system: "System", address: str) -> str:
    """Address of a variable with its component, which goes without saying where there is only one."""
    if len(system.components) == 1 and address.partition(".")[0] not in system.components:
        return f"{next(iter(system.components))}.{address}"
    return address
