"""Options of commands that move an arm and record it: its virtual body and the folder."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import click

from orchestrator.cli.common import can_be_filled

BODY = click.option(
    "--body", default="arm", show_default=True, help="Model of the virtual arm; FILE.mo:Class for your own."
)
VALUES = click.option("--set", "values", metavar="NAME=NUMBER", multiple=True, help="A parameter of the virtual arm.")
OUT = click.option(
    "--out",
    "folder",
    metavar="DIR",
    type=click.Path(path_type=Path),
    required=True,
    callback=can_be_filled,
    help="Where to record.",
)


def arm_options(command: Callable[..., Any]) -> Callable[..., Any]:
    """Add --body, --set and --out, in this order."""
    return BODY(VALUES(OUT(command)))
