"""`misfit models`, `misfit build` and `misfit validate`."""

import os
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import click

from fmus.errors import MisfitError
from orchestrator.cli.common import can_be_filled, library_option, progress, result_options, show, write_json

if TYPE_CHECKING:
    from fmus.platforms import Platform


@click.command()
def models() -> None:
    """List the built-in models with their inputs and outputs."""
    from fmus.catalogue import built_in_models
    from fmus.errors import ModelicaError
    from orchestrator.models.symbolic import SymbolicModel

    for name, model in built_in_models().items():
        click.echo(click.wrap_text(f"{name}  {model.description} ({model.class_name})", 78, "", "    "))
        try:
            found = SymbolicModel(name, model.compile())
        except ModelicaError as error:
            click.echo(f"  cannot be read here: {error}")
            continue
        # Where a learned force enters is no input that anybody records.
        inputs = [v for v in found.inputs if not v.name.startswith("correction_")]
        for what, variables in (("inputs", inputs), ("outputs", found.outputs)):
            names = ", ".join(f"{v.name} ({v.unit})" if v.unit not in ("", "1") else v.name for v in variables)
            click.echo(click.wrap_text(f"{what}: {names or 'none'}", 78, "  ", "    "))


@click.command()
@click.argument("names", nargs=-1, metavar="[MODEL]...")
@library_option
@click.option(
    "--out",
    "folder",
    default="fmus/build",
    show_default=True,
    metavar="DIR",
    callback=can_be_filled,
    help="Where to write the FMUs.",
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
    """Build NAME.fmu (FMI 2.0) and NAME.fmi3.fmu (FMI 3.0) of built-in models, FILE.mo:Package.Class, saved blocks (FILE.json)
    or coupled systems (FILE.toml, .ssd, .ssp), which become one FMU each.

    Without a name all built-in models are built. What has not changed comes from the cache.
    """
    from fmus.build import build_all, targets_of
    from fmus.catalogue import built_in_models, find_modelica_model
    from fmus.platforms import find_platforms

    blocks = [Path(name) for name in names if name.endswith(".json")]
    systems = [Path(name) for name in names if name.lower().endswith(_SYSTEMS)]
    others_than = (".json", *_SYSTEMS)
    models = [
        find_modelica_model(name) for name in names or built_in_models() if not name.lower().endswith(others_than)
    ]
    others = find_platforms(platforms) if platforms else ()
    targets = targets_of(models, Path(folder), others)
    with progress(quiet) as say:
        say(f"building {len(targets) + 2 * len(blocks) + 2 * len(systems)} FMUs")
        notes = build_all(targets, workers) if targets else {}
        learned = [*_blocks(blocks, Path(folder), others), *_coupled(systems, Path(folder), others, notes)]
    if not quiet:
        for name, found in notes.items():
            click.echo("\n".join(f"{name}: {note}" for note in found), err=True)
    show("\n".join(map(str, [*(target.path for target in targets), *learned])), quiet)


# Files that describe a coupled system.
_SYSTEMS = (".toml", ".ssd", ".ssp")


def _coupled(
    files: Sequence[Path], folder: Path, platforms: "tuple[Platform, ...]", notes: dict[str, tuple[str, ...]]
) -> list[Path]:
    """One FMU of each coupled system, in all FMI versions; what was assumed goes to `notes`."""
    if not files:
        return []
    from orchestrator.cosim.container import build_container

    made: list[Path] = []
    for file in _named(files).values():
        found, said = build_container(file, folder, platforms)
        made += found
        notes.update({file.name: said} if said else {})
    return made


def _named(files: Sequence[Path]) -> dict[str, Path]:
    """Files by the names of their FMUs."""
    named: dict[str, Path] = {}
    for file in files:
        if named.setdefault(file.stem, file) != file:
            raise MisfitError(f"{named[file.stem]} and {file} both build {file.stem}.fmu; use two --out folders")
    return named


def _blocks(files: Sequence[Path], folder: Path, platforms: "tuple[Platform, ...]") -> list[Path]:
    """FMUs of saved blocks, in all FMI versions."""
    if not files:
        return []
    from fmus.build import SUFFIXES
    from orchestrator.gp.export import block_fmu
    from orchestrator.gp.saved import read_block

    read = {name: read_block(file) for name, file in _named(files).items()}
    return [
        block_fmu(block, folder / f"{name}{suffix}", fmi_version, platforms)
        for name, block in read.items()
        for fmi_version, suffix in SUFFIXES.items()
    ]


@click.command()
@click.argument("files", nargs=-1, required=True, metavar="FMU...")
@result_options(html=False)
def validate(files: tuple[str, ...], json_file: str | None, quiet: bool, workers: int) -> None:
    """Check FMUs; one line a finding, exit code 1 if there is any, 2 if a file is no FMU."""
    from concurrent.futures import ThreadPoolExecutor

    from fmus.validate import Validation, examine_fmu
    from orchestrator.measurements.wording import counted

    broken: list[MisfitError] = []

    def examined(name: str) -> Validation:
        try:
            return examine_fmu(Path(name))
        except MisfitError as error:  # the other files are checked all the same
            broken.append(error)
            return Validation((str(error),))

    with progress(quiet) as say, ThreadPoolExecutor(workers) as pool:
        say(f"checking {counted(len(files), 'FMU')}")
        # Each is run in a process of its own; threads only wait for those.
        found = dict(zip(files, pool.map(examined, files), strict=True))
    fmus = [{"file": n, "findings": list(each.findings), "notes": list(each.notes)} for n, each in found.items()]
    if len(files) == 1 and broken:
        raise broken[0]
    write_json(json_file, {"schema": "misfit.validate/1", "fmus": fmus})
    lines = [f"{name}: {finding}" for name, each in found.items() for finding in each.findings]
    notes = [f"{name}: {note}" for name, each in found.items() for note in each.notes]
    if json_file != "-":
        for line in [*lines, *([] if quiet else notes)]:
            show(line, False)
    if lines:
        sys.exit(2 if broken else 1)
    if json_file != "-" and not quiet:
        click.echo(f"{counted(len(files), 'FMU')} without findings")
