"""Modelica models to FMU files: in parallel, and only what has changed since it was last built."""

import hashlib
import os
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from importlib.metadata import version
from pathlib import Path

from fmus.catalogue import ModelicaModel
from fmus.children import BrokenWorker, Workers
from fmus.errors import FmuError, MisfitError
from fmus.files import cache_folder, write_atomically
from fmus.frontend.closure import library_files
from fmus.library import library_root
from fmus.package import build_fmu
from fmus.platforms import Platform, zig_version
from fmus.reference_files import reference_files

SUFFIXES = {"2.0": ".fmu", "3.0": ".fmi3.fmu"}


@dataclass(frozen=True)
class Target:
    """A model in one FMI version, and the file that its FMU goes to."""

    model: ModelicaModel
    fmi_version: str
    path: Path
    platforms: tuple[Platform, ...] = ()


def targets_of(models: Iterable[ModelicaModel], folder: Path, platforms: tuple[Platform, ...] = ()) -> list[Target]:
    """All versions of all models as files of a folder, for this machine and other platforms.

    Args:
        models: what is to be built.
        folder: where the FMUs go.
        platforms: others than this machine, for which Zig cross-compiles.

    Raises:
        FmuError: if two models would be written to the same file.
    """
    targets: dict[Path, Target] = {}
    for model in models:
        for fmi_version, suffix in SUFFIXES.items():
            path = folder / f"{model.name.rsplit('.', 1)[-1]}{suffix}"
            other = targets.setdefault(path, Target(model, fmi_version, path, platforms))
            if other.model != model:
                raise FmuError(f"{other.model.name} and {model.name} both build {path.name}; use two --out folders")
    return list(targets.values())


def build_all(targets: Sequence[Target], workers: int) -> dict[str, tuple[str, ...]]:
    """Write all targets; what was built before from the same sources comes from the cache.

    Returns:
        What was assumed or not checked, by the names of the models that were built.

    Raises:
        MisfitError: if a model cannot be compiled or its FMU cannot be built or written; the others are there then.
    """
    kept = _kept(targets)
    missing = [target for target in targets if not kept[target].is_file()]
    jobs: dict[ModelicaModel, list[tuple[Target, Path]]] = {}
    for target in missing:
        jobs.setdefault(target.model, []).append((target, kept[target]))
    notes = _all_built(jobs, workers)
    failures = [each for each in notes if isinstance(each, Exception)]
    for target in targets:
        if not failures or kept[target].is_file():  # what could be built is there, whatever became of the rest
            _deliver(kept[target].read_bytes(), target.path)
    for target, path in _kept(missing).items():
        if path != kept[target]:  # a source was edited during the build, so the file belongs to neither text
            kept[target].unlink(missing_ok=True)
    if failures:
        raise failures[0]
    return {model.name: found for model, found in zip(jobs, notes, strict=True) if found and isinstance(found, tuple)}


def _all_built(
    jobs: Mapping[ModelicaModel, Sequence[tuple[Target, Path]]], workers: int
) -> list[tuple[str, ...] | Exception]:
    """What each build assumed, or why it failed."""
    if len(jobs) < 2 or workers < 2:
        return [_attempt(partial(_build, model, files)) for model, files in jobs.items()]
    # CasADi's reference counts are not safe in threads, and a fork would copy threads in the middle of their work.
    with Workers(min(workers, len(jobs))) as pool:
        doing = [pool.submit(_build, model, files) for model, files in jobs.items()]
        return [_attempt(each.result) for each in doing]


def _attempt(build: Callable[[], tuple[str, ...]]) -> tuple[str, ...] | Exception:
    try:
        return build()
    except (MisfitError, BrokenWorker) as error:
        return error


def _build(model: ModelicaModel, files: Sequence[tuple[Target, Path]]) -> tuple[str, ...]:
    system = model.compile()
    extra_files = reference_files(system, model.stop_time_s, model.step_size_s)
    for target, path in files:
        build_fmu(
            system,
            path,
            fmi_version=target.fmi_version,
            stop_time=model.stop_time_s,
            step_size=model.step_size_s,
            extra_files=extra_files,
            platforms=target.platforms,
        )
    return system.notes


def _deliver(content: bytes, path: Path) -> None:
    try:
        # An unchanged file keeps its time stamp, so that whatever depends on it is not made again.
        if not path.is_file() or path.read_bytes() != content:
            write_atomically(path, content)
    except OSError as error:
        raise FmuError(f"cannot write {path}: {error.strerror}") from error


def _kept(targets: Sequence[Target]) -> dict[Target, Path]:
    """Where the cache holds the FMUs, by the content of everything that they are made of."""
    tools = [f"{name} {version(name)}" for name in ("casadi", "fmpy", "rumoca")]
    shared = _digest(_shared_ingredients()) if targets else ""
    paths = {}
    for target in targets:
        model = target.model
        experiment = f"{model.stop_time_s!r} {model.step_size_s!r}"
        own = _digest(_own_ingredients(model))
        compiler = f"{os.environ.get('CC', '')} {os.environ.get('CFLAGS', '')}"
        facts = [model.name, model.class_name, experiment, target.fmi_version, compiler, *tools]
        facts += [zig_version(), *(platform.name for platform in target.platforms)] if target.platforms else []
        name = hashlib.sha256("\0".join([*facts, shared, own]).encode()).hexdigest()
        paths[target] = cache_folder("fmu") / f"{name}.fmu"
    return paths


def _digest(files: Iterable[Path]) -> str:
    digest = hashlib.sha256()
    for path in files:
        content = path.read_bytes()
        digest.update(f"\0{path.name}\0{len(content)}\0".encode() + content)
    return digest.hexdigest()


def _shared_ingredients() -> Iterator[Path]:
    """The Modelica library and the factory's own code."""
    yield from sorted(library_root().rglob("*.mo"))
    package = Path(__file__).parent
    for pattern in ("*.py", "*.[ch]", "*.toml"):
        yield from sorted(package.rglob(pattern))


def _own_ingredients(model: ModelicaModel) -> Iterator[Path]:
    """The model's file, and what it needs of its package and of libraries; nothing for a class of misfit's own library."""
    if model.file is not None:
        yield model.file
        yield from library_files(model.class_name, model.file).values()
