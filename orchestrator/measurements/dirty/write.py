"""Write a plan: the case.toml, and copies of files that lie elsewhere."""

from collections.abc import Sequence
from pathlib import Path

from fmus.errors import MisfitError
from fmus.files import write_atomically
from orchestrator.measurements.dirty.case_text import MADE, case_text
from orchestrator.measurements.dirty.plan import Plan

CASE = "case.toml"


def home_of(paths: Sequence[Path]) -> Path:
    """The folder of the files, where case.toml belongs if nothing else is said.

    Raises:
        MisfitError: they lie in several folders.
    """
    folders = {(path if path.is_dir() else path.parent).resolve() for path in paths}
    if len(folders) > 1:
        raise MisfitError(
            f"the files lie in {len(folders)} folders; say with --out DIR where case.toml and copies of them go"
        )
    return paths[0] if paths[0].is_dir() else paths[0].parent


def require_free(folder: Path) -> None:
    """Refuse to write over a case.toml that was written by hand.

    Raises:
        MisfitError: there is one.
    """
    case = folder / CASE
    if case.exists() and not case.read_text(errors="replace").startswith(MADE):
        raise MisfitError(
            f"{case} exists and was not written by `misfit import`; choose another folder with --out DIR, or remove it"
        )


def write_plan(plan: Plan, folder: Path) -> Path:
    """Write case.toml into a folder, with copies of files that lie elsewhere; returns its path.

    Raises:
        MisfitError: a hand-written case.toml is there, or two files have one name.
    """
    require_free(folder)
    names = [file.path.name for file in plan.files]
    twice = {name for name in names if names.count(name) > 1}
    if twice:
        raise MisfitError(f"two files are named {min(twice)!r}; rename one, as both go into {folder}")
    text = case_text(plan, names)
    folder.mkdir(parents=True, exist_ok=True)
    for file in plan.files:
        target = folder / file.path.name
        if target.resolve() != file.path.resolve():
            write_atomically(target, file.path.read_bytes())
    write_atomically(folder / CASE, text.encode())
    return folder / CASE
