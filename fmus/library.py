"""Where Modelica classes are found beside the user's file: misfit's own library, and those of `--library` and MODELICAPATH."""

import os
import re
from functools import lru_cache
from pathlib import Path

_DECLARED = re.compile(r"^\s*(?:encapsulated\s+)?(?:package|model|class|operator\s+record|type)\s+(\w+)", re.MULTILINE)


def library_root() -> Path:
    """Return the folder that contains `FESArm/package.mo`: beside the package in a checkout, inside it in an installed wheel."""
    package = Path(__file__).resolve().parent
    installed = package / "modelica"
    return installed if installed.is_dir() else package.parent / "modelica"


def standard_subset() -> Path:
    """Return the folder of the units, constants and signals that stand in where the Modelica Standard Library is not given."""
    return Path(__file__).resolve().parent / "standard" / "Modelica"


def libraries() -> dict[str, Path]:
    """Return the top-level classes of all libraries: name to package folder, or to the file of a single class.

    The folders of MODELICAPATH, to which `--library` adds, go before misfit's own. Each holds packages, as a folder of its own
    each (which may have a version in its name, `Modelica 4.0.0`), or is the folder of a package itself, whose neighbours count,
    too. Without a `Modelica` among them a small subset stands in for it.
    """
    return {"Modelica": standard_subset()} | dict(_found(os.environ.get("MODELICAPATH", ""), library_root()))


def library_folders() -> tuple[str, ...]:
    """Return the folders that are searched before misfit's own, as `--library` and MODELICAPATH name them."""
    return tuple(part for part in os.environ.get("MODELICAPATH", "").split(os.pathsep) if part)


def add_library(folder: Path) -> None:
    """Look in a folder before all others, in this process and those that it starts."""
    before = [part for part in os.environ.get("MODELICAPATH", "").split(os.pathsep) if part]
    os.environ["MODELICAPATH"] = os.pathsep.join(dict.fromkeys([str(folder.resolve()), *before]))


@lru_cache(maxsize=8)
def _found(path: str, own: Path) -> tuple[tuple[str, Path], ...]:
    found: dict[str, Path] = {}
    folders = [Path(part) for part in path.split(os.pathsep) if part]
    for folder in [f for f in folders if f.is_dir()] + [own]:
        inside = folder
        if (folder / "package.mo").is_file():
            found.setdefault(_name_of(folder), folder)
            inside = folder.parent
        for entry in sorted(inside.iterdir(), reverse=True):  # of several versions the highest
            if (entry / "package.mo").is_file():
                found.setdefault(_name_of(entry), entry)
            elif entry.suffix == ".mo" and entry.is_file() and not (inside / "package.mo").is_file():
                found.setdefault(entry.stem, entry)
    return tuple(found.items())


def _name_of(folder: Path) -> str:
    """Name of the package that a folder holds; the folder's own name may end in a version."""
    name = folder.name.split(" ")[0]
    declared = _DECLARED.search((folder / "package.mo").read_text(errors="replace")[:20_000])
    return declared.group(1) if declared else name
