"""`misfit models`, `misfit build` and `misfit validate`."""

import sys
from concurrent.futures import ThreadPoolExecutor
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
    "--out", "folder", default="fmus/build", show_default=True, metavar="DIR", help="Where to write NAME.fmu."
)
@click.option("--workers", type=click.IntRange(1, 64), default=2, show_default=True, help="Builds that run at a time.")
@click.option("--quiet", is_flag=True, help="Print nothing but errors.")
def build(names: tuple[str, ...], folder: str, workers: int, quiet: bool) -> None:
    """Build FMUs (FMI 2.0 co-simulation) of built-in models or of FILE.mo:Package.Class; all built-ins by default."""
    from fmus.catalogue import built_in_models, find_modelica_model
    from fmus.package import build_fmu

    sources = [find_modelica_model(name) for name in names or built_in_models()]
    target = Path(folder)
    target.mkdir(parents=True, exist_ok=True)

    with progress(quiet) as say, ThreadPoolExecutor(workers) as pool:
        say(f"building {len(sources)} FMUs")
        jobs = [
            pool.submit(
                build_fmu,
                source.compile(),
                target / f"{source.name.rsplit('.', 1)[-1]}.fmu",
                stop_time=source.stop_time_s,
                step_size=source.step_size_s,
            )
            for source in sources
        ]
        paths = [job.result() for job in jobs]
    show("\n".join(str(path) for path in paths), quiet)


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
