"""`misfit convert`: a system in another format."""

import os
import shutil
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import click

from fmus.errors import MisfitError
from orchestrator.cli.common import can_be_written, show, write_file
from orchestrator.measurements.wording import shown

if TYPE_CHECKING:
    from orchestrator.cosim.system import System


@click.command()
@click.argument("model", metavar="SYSTEM")
@click.argument("out", metavar="OUT", callback=can_be_written)
@click.option("--quiet", is_flag=True, help="Print nothing but errors.")
def convert(model: str, out: str, quiet: bool) -> None:
    """Write SYSTEM as OUT: an .ssp with its FMUs in it, or a .toml with them beside it."""
    from orchestrator.cosim.load import load_system

    target = Path(out)
    system = load_system(model)
    if target.suffix.lower() == ".ssp":
        from orchestrator.cosim.ssp import write_ssp

        write_ssp(system, target)
    elif target.suffix.lower() == ".toml":
        from orchestrator.cosim.toml_file import write_toml

        write_file(out, write_toml(_beside(system, target.parent)))
    else:
        raise MisfitError(f"{target}: ending {shown(target.suffix)}; expected .ssp or .toml")
    show("\n".join((*system.notes, str(target))), quiet)


def _beside(system: "System", folder: Path) -> "System":
    """The system as seen from a folder, to which files are copied that are not below it."""
    components = {}
    for name, spec in system.components.items():
        place, colon, inside = spec.source.partition(".py:")  # file.py:NAME of a component in Python
        path = system.folder / (f"{place}.py" if colon else place)
        if spec.source and path.exists():
            moved = os.path.relpath(_near(path.resolve(), folder.resolve(), name), folder.resolve())
            spec = replace(spec, source=Path(moved).as_posix() + (f":{inside}" if colon else ""))
        components[name] = spec
    return replace(system, components=components, folder=folder)


def _near(path: Path, folder: Path, name: str) -> Path:
    """The path, or a copy below the folder where a file is elsewhere."""
    if path.is_dir() or path.is_relative_to(folder):
        return path
    copy = folder / "resources" / path.name
    if copy.is_file() and copy.read_bytes() != path.read_bytes():
        copy = copy.with_stem(f"{copy.stem}_{name}")
    copy.parent.mkdir(parents=True, exist_ok=True)
    return Path(shutil.copyfile(path, copy))
