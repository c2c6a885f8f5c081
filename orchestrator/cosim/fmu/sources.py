"""The binary of an FMU that comes as sources, made with the C compiler of the machine and kept."""

import hashlib
import os
import tempfile
from collections.abc import Iterator
from importlib.util import find_spec
from pathlib import Path

from fmus.archive import check_entry_name
from fmus.children import run_tool
from fmus.errors import FmuError
from fmus.files import cache_folder
from fmus.runtime.compiler import find_compiler, first_error
from orchestrator.cosim.fmu.description import FmuDescription, Interface, SourceSet

_STANDARDS = {"C89": "-std=gnu89", "C90": "-std=gnu90", "C99": "-std=gnu99", "C11": "-std=gnu11", "C17": "-std=gnu17"}
# Multiply-adds are not contracted, so that the result does not depend on the machine.
_FLAGS = ("-O2", "-fPIC", "-ffp-contract=off", "-w")


def compile_sources(description: FmuDescription, interface: Interface, folder: Path) -> Path:
    """Compile the sources of an unpacked FMU into a shared library.

    Raises:
        FmuError: without a compiler, for sources that are not C, or with the compiler's first error.
    """
    compiler = find_compiler()
    key = hashlib.sha256(" ".join((*compiler, *_FLAGS, description.digest, interface.identifier)).encode()).hexdigest()
    target = cache_folder("compiled") / f"{key}.so"
    if target.is_file():
        return target
    headers = _headers()
    with tempfile.TemporaryDirectory(dir=target.parent) as build:
        objects = []
        for number, (source, arguments) in enumerate(_units(description, interface, folder / "sources")):
            objects.append(str(Path(build) / f"{number}.o"))
            includes = ["-I", str(folder / "sources"), "-I", headers]
            _run(description, [*compiler, *_FLAGS, *arguments, *includes, "-c", str(source), "-o", objects[-1]])
        built = Path(build) / "library.so"
        _run(description, [*compiler, "-shared", "-o", str(built), *objects, "-lm"])
        os.replace(built, target)
    return target


def _headers() -> str:
    """Folder of the headers of FMI, which FMPy brings along."""
    spec = find_spec("fmpy")
    assert spec is not None and spec.origin is not None
    return str(Path(spec.origin).parent / "c-code")


def _units(description: FmuDescription, interface: Interface, sources: Path) -> Iterator[tuple[Path, list[str]]]:
    for part in interface.sources:
        arguments = _arguments(description, part, sources)
        for name in part.files:
            check_entry_name(name)
            path = sources / name
            if not path.is_file():
                raise FmuError(f"{description.path.name} names the source {name}, which is not in its folder sources")
            if path.suffix.lower() == ".c":
                yield path, arguments
            elif path.suffix.lower() not in (".h", ".hpp"):
                raise FmuError(f"{description.path.name}: source {name} is not C; only C sources are compiled here")


def _arguments(description: FmuDescription, part: SourceSet, sources: Path) -> list[str]:
    if part.language and part.language not in _STANDARDS:
        raise FmuError(f"{description.path.name}: its sources are {part.language}; only C sources are compiled here")
    # Sources are often written for static linking, with a prefix in front of every function.
    arguments = [_STANDARDS.get(part.language, "-std=gnu99"), f"-DFMI{description.version}_OVERRIDE_FUNCTION_PREFIX"]
    arguments += [f"-D{name}={value}" if value else f"-D{name}" for name, value in part.definitions.items()]
    for name in part.includes:
        check_entry_name(name)
        arguments += ["-I", str(sources / name)]
    return arguments


def _run(description: FmuDescription, command: list[str]) -> None:
    done = run_tool(command)
    if done.returncode != 0:
        raise FmuError(f"{description.path.name}: its sources do not compile: {first_error(done.stderr)}")
