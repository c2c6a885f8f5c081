"""Files from the browser: streamed to disk within limits, checked, and only then part of a project."""

import asyncio
import os
import re
import tempfile
import zipfile
from collections.abc import AsyncIterator, Callable
from pathlib import Path, PurePosixPath

from fmus.archive import check_archive, read_archive
from fmus.errors import MisfitError, ModelicaError
from fmus.files import write_atomically
from fmus.frontend.lint.parser import parse
from fmus.frontend.lint.sources import modelica_text
from fmus.frontend.lint.tree import ClassDef
from orchestrator.measurements.load import TEXT_ENDINGS, TYPED_ENDINGS
from orchestrator.studio import jobs
from orchestrator.studio.names import safe_name
from orchestrator.studio.project import Project

KINDS = ("model", "block")


def model_classes(file: Path, name: str) -> tuple[str, ...]:
    """Full names of the models of a file; those that no other one contains come first, the last declared before the others.

    Args:
        file: where it is now.
        name: what the user calls it, for messages.

    Raises:
        MisfitError: it is no Modelica, or declares no model.
    """
    try:
        top = parse(modelica_text(file), name)
    except (ModelicaError, UnicodeDecodeError) as error:
        raise MisfitError(f"{name} was not taken as a model: {error}") from error
    found = [pair for each in top for pair in _models(each, "")]
    if not found:
        raise MisfitError(f"{name} was not taken as a model: it declares no model or block that is not partial")
    used = {".".join(c.type_name).rsplit(".", 1)[-1] for _, each in found for c in each.components.values()}
    free = [full for full, _ in found if full.rsplit(".", 1)[-1] not in used]
    return (*reversed(free), *(full for full, _ in found if full not in free))


def _models(definition: ClassDef, prefix: str) -> list[tuple[str, ClassDef]]:
    full = f"{prefix}{definition.name}"
    own = [(full, definition)] if definition.kind in KINDS and "partial" not in definition.prefixes else []
    return own + [pair for each in definition.classes.values() for pair in _models(each, f"{full}.")]


DATA_ENDINGS = (*TEXT_ENDINGS, *TYPED_ENDINGS)
MODEL_ENDINGS = (".fmu", ".mo")
CASE = "case.toml"
# Texts that lie beside recordings in a zip.
_PROSE = re.compile(r"(?:readme|licen[cs]e|notes?|changelog)\b", re.IGNORECASE)
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
    ending = PurePosixPath(name).suffix.lower()
    if ending not in MODEL_ENDINGS:
        raise MisfitError(f"{name} was not taken as a model: expected a file that ends with .fmu or .mo")
    classes: tuple[str, ...] = ()
    if ending == ".mo":
        classes = model_classes(file, name)
    else:
        checked(file, name, "modelDescription.xml")
        require_binary(file, name)
    folder = project.folder / "model"
    folder.mkdir(exist_ok=True)
    for other in folder.iterdir():
        other.unlink()
    target = folder / f"{name[: -len(ending)]}{ending}"
    file.replace(target)
    chosen = str(target.relative_to(project.folder))
    project.choose_model(f"{chosen}:{classes[0]}" if classes else chosen, classes)
    return f"{name} is the model now." + (f" Its class {classes[0]} is used." if len(classes) > 1 else "")


def require_binary(file: Path, name: str) -> None:
    """Refuse an FMU that holds no program for this machine, in words that say so.

    Raises:
        MisfitError: there is none.
    """
    with zipfile.ZipFile(file) as archive:
        folders = {
            parts[1] for entry in archive.namelist() if len(parts := entry.split("/")) > 2 and parts[0] == "binaries"
        }
        sources = any(entry.startswith("sources/") and entry.endswith(".c") for entry in archive.namelist())
    own = {"linux64", "x86_64-linux", "aarch64-linux"}
    if not folders & own:
        there = f"only for {', '.join(sorted(folders))}" if folders else "none at all"
        hint = "it has C sources, which are not compiled here; " if sources else ""
        raise MisfitError(
            f"{name} holds no program for this machine (binaries: {there}); {hint}export it again for Linux, 64 bit"
        )


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
            f"{name} was not taken as measurements: expected case.toml, a zip, or csv, txt, parquet, mf4 or h5 files"
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
        if (PurePosixPath(path).suffix.lower() in DATA_ENDINGS and not _PROSE.match(PurePosixPath(path).name))
        or PurePosixPath(path).name == CASE
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
