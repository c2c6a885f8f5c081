"""FMUs of others that come as sources: what is to be compiled, and the compiling, within limits."""

import time
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from importlib.util import find_spec
from pathlib import Path, PurePosixPath, PureWindowsPath
from tempfile import TemporaryDirectory
from typing import Any

from fmus.archive import check_entry_name
from fmus.children import run_tool
from fmus.children.start import ToolTimeout
from fmus.errors import FmuError
from fmus.runtime.compiler import find_compiler, first_error

_STANDARDS = {"C89": "-std=gnu89", "C90": "-std=gnu90", "C99": "-std=gnu99", "C11": "-std=gnu11", "C17": "-std=gnu17"}
# Multiply-adds are not contracted, so that the result does not depend on the machine.
FLAGS = ("-O2", "-fPIC", "-ffp-contract=off", "-w")
# For all files of an FMU, and for each process of the compiler. The largest sources of the public repositories take 30 s and 1 GiB.
TIME_LIMIT_S = 120.0
MEMORY_LIMIT_GIB = 2.0
# What GCC and Clang say beyond it.
_OUT_OF_MEMORY = ("out of memory", "virtual memory exhausted", "Cannot allocate memory", "bad_alloc", "Killed signal")


@dataclass(frozen=True)
class SourceSet:
    """Source files to compile, below `sources/`, with their definitions (name -> value) and include folders."""

    language: str
    files: tuple[str, ...]
    definitions: Mapping[str, str]
    includes: tuple[str, ...]


def sources_of(parsed: Any, identifier: str) -> tuple[SourceSet, ...]:
    """The sources of an interface, from a model description as FMPy reads it."""
    for configuration in parsed.buildConfigurations:
        # The only one there is has to be meant, even where its identifier is another.
        if configuration.modelIdentifier == identifier or len(parsed.buildConfigurations) == 1:
            return tuple(
                SourceSet(
                    language=part.language or "",
                    files=tuple(part.sourceFiles),
                    definitions={d.name: d.value or "" for d in part.preprocessorDefinitions if not d.optional},
                    includes=tuple(part.includeDirectories),
                )
                for part in configuration.sourceFileSets
            )
    return ()


def check_identifier(identifier: str, fmu: str) -> None:
    """Raise FmuError unless the name of a binary stays in its folder.

    Example:
        >>> check_identifier("../../x", "a.fmu")
        Traceback (most recent call last):
            ...
        fmus.errors.FmuError: a.fmu: modelIdentifier '../../x' is no name of a file; expected a name such as 'Pump'
    """
    parts = {identifier} == {PurePosixPath(identifier).name} == {PureWindowsPath(identifier).name}
    if not identifier or not parts or identifier in (".", "..") or "\0" in identifier:
        raise FmuError(f"{fmu}: modelIdentifier {identifier!r} is no name of a file; expected a name such as 'Pump'")


def compile_library(fmu: str, version: int, sets: Sequence[SourceSet], sources: Path, target: Path) -> None:
    """Compile C sources into a shared library.

    Args:
        fmu: name of the FMU, for messages.
        version: of FMI.
        sets: what to compile.
        sources: the FMU's folder `sources`.
        target: file to write, in a folder that exists.

    Raises:
        FmuError: without a compiler, for sources that are not C, beyond the limits, or with the compiler's first error.
    """
    compiler = find_compiler()
    deadline = time.monotonic() + TIME_LIMIT_S
    with TemporaryDirectory(dir=target.parent) as build:
        objects = []
        for number, (source, arguments) in enumerate(_units(fmu, version, sets, sources)):
            objects.append(str(Path(build) / f"{number}.o"))
            includes = ["-I", str(sources), "-I", _headers()]
            _run(fmu, [*compiler, *FLAGS, *arguments, *includes, "-c", str(source), "-o", objects[-1]], deadline)
        built = Path(build) / "library.so"
        _run(fmu, [*compiler, "-shared", "-o", str(built), *objects, "-lm"], deadline)
        built.replace(target)


def _headers() -> str:
    """Folder of the headers of FMI, which FMPy brings along."""
    spec = find_spec("fmpy")
    assert spec is not None and spec.origin is not None
    return str(Path(spec.origin).parent / "c-code")


def _units(fmu: str, version: int, sets: Sequence[SourceSet], sources: Path) -> Iterator[tuple[Path, list[str]]]:
    for part in sets:
        arguments = _arguments(fmu, version, part, sources)
        for name in part.files:
            check_entry_name(name)
            path = sources / name
            if not path.is_file():
                raise FmuError(
                    f"{fmu} has no binary for this system, and its source {name} is not in its folder sources"
                )
            if path.suffix.lower() == ".c":
                yield path, arguments
            elif path.suffix.lower() not in (".h", ".hpp"):
                raise FmuError(f"{fmu}: source {name} is not C; only C sources are compiled here")


def _arguments(fmu: str, version: int, part: SourceSet, sources: Path) -> list[str]:
    if part.language and part.language not in _STANDARDS:
        raise FmuError(f"{fmu}: its sources are {part.language}; only C sources are compiled here")
    # Sources are often written for static linking, with a prefix in front of every function.
    arguments = [_STANDARDS.get(part.language, "-std=gnu99"), f"-DFMI{version}_OVERRIDE_FUNCTION_PREFIX"]
    arguments += [f"-D{name}={value}" if value else f"-D{name}" for name, value in part.definitions.items()]
    for name in part.includes:
        check_entry_name(name)
        arguments += ["-I", str(sources / name)]
    return arguments


def _run(fmu: str, command: list[str], deadline: float) -> None:
    try:
        done = run_tool(command, timeout_s=max(deadline - time.monotonic(), 0.01), memory_gib=MEMORY_LIMIT_GIB)
    except ToolTimeout as error:
        raise FmuError(f"{fmu}: compiling its sources took more than {TIME_LIMIT_S:.0f} s and was stopped") from error
    if done.returncode != 0:
        said = first_error(done.stderr)
        if any(words in done.stderr for words in _OUT_OF_MEMORY):
            said = f"the compiler took more than {MEMORY_LIMIT_GIB:g} GiB of memory and was stopped"
        raise FmuError(f"{fmu}: its sources do not compile: {said}")
