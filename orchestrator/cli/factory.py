"""`misfit models`, `misfit build` and `misfit validate`."""

import os
import sys
from pathlib import Path

import click

from orchestrator.cli.common import progress, show


@click.command()
def models() -> None:
    """List the built-in models."""
    from fmus.catalogue import built_in_models

    for name, model in built_in_models().items():
        click.echo(f"{name:12s} {model.class_name:34s} {model.description}")


@click.command()
@click.argument("names", nargs=-1, metavar="[MODEL]...")
@click.option(
    "--out", "folder", default="fmus/build", show_default=True, metavar="DIR", help="Where to write the FMUs."
)
@click.option(
    "--workers",
    type=click.IntRange(1, 64),
    default=os.cpu_count() or 1,
    show_default=True,
    help="Builds that run at a time.",
)
@click.option(
    "--platforms",
    metavar="NAMES",
    help="More platforms, with commas: aarch64-linux, x86_64-windows, x86_64-darwin, aarch64-darwin.",
)
@click.option("--quiet", is_flag=True, help="Print nothing but errors.")
def build(names: tuple[str, ...], folder: str, workers: int, platforms: str | None, quiet: bool) -> None:
    """Build NAME.fmu (FMI 2.0) and NAME.fmi3.fmu (FMI 3.0) of built-in models or FILE.mo:Package.Class.

    Without a name all built-in models are built. What has not changed comes from the cache.
    """
    from fmus.build import build_all, targets_of
    from fmus.catalogue import built_in_models, find_modelica_model
    from fmus.platforms import find_platforms

    models = [find_modelica_model(name) for name in names or built_in_models()]
    targets = targets_of(models, Path(folder), find_platforms(platforms) if platforms else ())
    with progress(quiet) as say:
        say(f"building {len(targets)} FMUs")
        build_all(targets, workers)
    show("\n".join(str(target.path) for target in targets), quiet)


@click.command()
@click.argument("files", nargs=-1, required=True, metavar="FMU...")
def validate(files: tuple[str, ...]) -> None:
    """Check FMUs; one line a finding, exit code 1 if there is any."""
    from fmus.validate import validate_fmu

    findings = [f"{name}: {finding}" for name in files for finding in validate_fmu(Path(name))]
    for line in findings:
        click.echo(line)
    if findings:
        sys.exit(1)
    click.echo(f"{len(files)} FMU{'s' if len(files) > 1 else ''} without findings")
