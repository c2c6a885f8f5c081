"""Files from the browser: streamed to disk within limits, checked, and only then part of a project."""

import asyncio
import os
import tempfile
from collections.abc import AsyncIterator, Callable
from pathlib import Path, PurePosixPath

from fmus.archive import check_archive, read_archive
from fmus.errors import MisfitError
from fmus.files import write_atomically
from orchestrator.studio import jobs
from orchestrator.studio.names import safe_name
from orchestrator.studio.project import Project

DATA_ENDINGS = (".csv", ".parquet", ".mf4", ".mdf", ".h5", ".hdf5")
CASE = "case.toml"
MIB = 2**20


def upload_limit() -> int:
    """Largest upload in bytes; `MISFIT_UPLOAD_MIB` changes it."""
    return int(float(os.environ.get("MISFIT_UPLOAD_MIB", "512")) * MIB)


async def receive(project: Project, kind: str, name: str, chunks: AsyncIterator[bytes]) -> str:
    """Take one file, as the `model` or as `measurements`; returns what was done, in a sentence.

    Raises:
        MisfitError: if it is too large, no such file, or not safe to unpack; nothing is kept then.
    """
    return await keep(project, name, chunks, _model if kind == "model" else _measurements)


async def keep(
    project: Project, name: str, chunks: AsyncIterator[bytes], taken: Callable[[Project, str, Path], str]
) -> str:
    """Take one file and hand it to `taken`, which checks it, puts it where it belongs and says what was done.

    Raises:
        MisfitError: if it is too large, or `taken` refuses it; nothing is kept then.
    """
    name = safe_name(name)
    handle, temporary = tempfile.mkstemp(dir=project.folder, prefix=".upload-")
    try:
        with os.fdopen(handle, "wb") as stream:
            size = 0
            async for chunk in chunks:
                size += len(chunk)
                # What is too much is read but not kept: a browser shows no answer to what it could not send.
                if size <= upload_limit():
                    stream.write(chunk)
        _require_within_limit(name, size)
        await asyncio.to_thread(make_way, project)
        return await asyncio.to_thread(taken, project, name, Path(temporary))
    finally:
        Path(temporary).unlink(missing_ok=True)


def make_way(project: Project) -> None:
    """End the look at columns, which begins by itself and will begin again; refuse while the user's own job runs."""
    job = jobs.look(project)
    if job.running and job.kind != "match":
        raise MisfitError("model and measurements stay as they are while a job is running; cancel it first")
    jobs.cancel(project)


def _require_within_limit(name: str, size: int) -> None:
    if size > upload_limit():
        raise MisfitError(
            f"{name} is larger than {upload_limit() / MIB:g} MiB, the limit for uploads; "
            "take a part of it, or start the studio with a larger MISFIT_UPLOAD_MIB"
        )


def _model(project: Project, name: str, file: Path) -> str:
    if not name.lower().endswith(".fmu"):
        raise MisfitError(f"{name} was not taken as a model: expected a file that ends with .fmu")
    checked(file, name, "modelDescription.xml")
    folder = project.folder / "model"
    folder.mkdir(exist_ok=True)
    for other in folder.iterdir():
        other.unlink()
    target = folder / f"{name[:-4]}.fmu"
    file.replace(target)
    project.choose_model(str(target.relative_to(project.folder)))
    return f"{name} is the model now."


def _measurements(project: Project, name: str, file: Path) -> str:
    ending = PurePosixPath(name).suffix.lower()
    if ending == ".zip":
        contents = _zipped(file, name)
        project.forget_results()
        for inside, content in contents.items():
            write_atomically(project.measurements / inside, content)
        return f"{name}: {len(contents)} files added."
    if ending != ".toml" and ending not in DATA_ENDINGS:
        raise MisfitError(
            f"{name} was not taken as measurements: expected case.toml, a zip, or csv, parquet, mf4 or h5 files"
        )
    project.forget_results()
    file.replace(project.measurements / (CASE if ending == ".toml" else name))
    return f"{name} was added."


def _zipped(file: Path, name: str) -> dict[str, bytes]:
    """Measurements of a zip, relative to its case.toml if it has one; other files in it are left out."""
    checked(file, name, None)
    found = {
        path: content
        for path, content in read_archive(file, None).items()
        if PurePosixPath(path).suffix.lower() in DATA_ENDINGS or PurePosixPath(path).name == CASE
    }
    if len({safe_name(path) for path in found}) < len(found):
        raise MisfitError(f"{name} holds two files with the same name in different folders; zip one folder")
    cases = sorted((p for p in found if PurePosixPath(p).name == CASE), key=lambda p: p.count("/"))
    base = PurePosixPath(cases[0]).parent if cases else None
    kept = {}
    for path, content in found.items():
        inside = PurePosixPath(path)
        if base is None:
            kept[safe_name(path)] = content
        elif inside.is_relative_to(base):
            kept[str(inside.relative_to(base))] = content
    if not kept:
        raise MisfitError(f"{name} holds no measurements: expected case.toml or csv, parquet, mf4 or h5 files in it")
    return kept


def checked(file: Path, name: str, description: str | None) -> None:
    """Check an archive; messages name the user's file."""
    try:
        check_archive(file, description)
    except MisfitError as error:
        raise MisfitError(str(error).replace(str(file), name)) from error
