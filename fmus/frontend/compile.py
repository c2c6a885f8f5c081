"""Compile a Modelica class to its flat DAE, in a child process, and keep the result."""

import hashlib
import json
import subprocess
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from functools import cache
from importlib.metadata import version
from pathlib import Path
from typing import Any

from fmus.children import child_environment, python_command, run_child
from fmus.errors import ModelicaError
from fmus.files import cache_folder, write_atomically
from fmus.frontend.closure import check_libraries, library_files
from fmus.frontend.lint import check_units, lint_class
from fmus.frontend.lint.sources import modelica_text
from fmus.frontend.messages import explained
from fmus.frontend.rewrite import rewritten
from fmus.library import libraries, library_root

TIME_LIMIT_S = 120.0
# rumoca looks whether it is in a notebook.
NOT_NEEDED = "IPython"


def compile_class(model: str, file: Path | None = None) -> dict[str, Any]:
    """Return the flat DAE of a class of the library, or of `file`, which may use the library.

    Every class passes the linter before it is compiled. Results are kept in the cache by the content of all sources
    and of the linter, so an unchanged class costs one file read.

    Args:
        model: full name, such as `FESArm.Arms.Arm`.
        file: the `.mo` file that declares it; None for a class of the library.

    Raises:
        ModelicaError: if the class cannot be compiled, or would be compiled into something else than it says.
    """
    kept = kept_dae(model, file)
    if kept.is_file():
        return json.loads(kept.read_text())
    check_names(model, file)
    with laid_out(model, file) as (source, roots):
        return keep_dae(kept, _run_compiler(model, file, source, roots))


def check_names(model: str, file: Path | None) -> None:
    """Refuse what the compiler would misread, and libraries that are not there.

    Raises:
        ModelicaError: with file and line.
    """
    if file is not None:
        check_libraries(file)
    lint_class(model, file, [library_root()], libraries())


@contextmanager
def laid_out(model: str, file: Path | None) -> Iterator[tuple[Path, list[Path]]]:
    """Give the compiler the files that a class needs and no others: it reads all that it is shown, and all beside that.

    Yields:
        The file to compile, and the folders of the libraries.
    """
    root = library_root()
    with tempfile.TemporaryDirectory() as folder:
        copied = Path(folder) / "libraries"
        for name, path in library_files(model, file).items():
            place = copied.joinpath(*name)
            place = place / "package.mo" if path.name == "package.mo" else place.with_name(f"{name[-1]}.mo")
            place.parent.mkdir(parents=True, exist_ok=True)
            place.write_text(rewritten(modelica_text(path), path.name))
        roots = [copied, root] if copied.is_dir() else [root]
        if file is None:
            yield root / "FESArm" / "package.mo", roots
        elif (file.parent / "package.mo").exists():
            yield copied / model.split(".")[0] / "package.mo", roots
        else:
            alone = Path(folder) / "own" / file.name
            alone.parent.mkdir()
            alone.write_text(rewritten(modelica_text(file), file.name))
            yield alone, roots


def kept_dae(model: str, file: Path | None) -> Path:
    """Where the flat DAE of a class is kept."""
    return cache_folder("dae") / f"{fingerprint(model, file)}.json"


def keep_dae(kept: Path, text: str) -> dict[str, Any]:
    """Check the units of a compiled class and keep it.

    Raises:
        ModelicaError: if they do not agree.
    """
    dae: dict[str, Any] = json.loads(text)
    dae["unit_places"] = check_units(dae)
    write_atomically(kept, json.dumps(dae).encode())
    return dae


def _run_compiler(model: str, file: Path | None, source: Path, roots: list[Path]) -> str:
    command = python_command("fmus.frontend.worker", model, str(source), *map(str, roots))
    try:
        done = run_child(command, environment=child_environment(MISFIT_WITHOUT=NOT_NEEDED), timeout_s=TIME_LIMIT_S)
    except subprocess.TimeoutExpired:
        raise ModelicaError(f"compiling {model} took longer than {TIME_LIMIT_S:.0f} s; simplify the class") from None
    if done.returncode == 2:
        raise ModelicaError(_explained(done.stderr.decode(errors="replace"), model, file))
    if done.returncode != 0:
        raise ModelicaError(f"the Modelica compiler crashed on {model} (exit {done.returncode}); check {source.name}")
    return done.stdout.decode()


def _explained(message: str, model: str, file: Path | None) -> str:
    root = library_root()
    return explained(message, model, file or root / "FESArm" / "package.mo", [root], libraries())


def fingerprint(model: str, file: Path | None = None) -> str:
    """Content hash of all that a class is compiled from: its sources, the library, the compiler and the linter.

    Raises:
        ModelicaError: if the file does not exist.
    """
    digest = hashlib.sha256(f"{_surroundings()} {model}".encode())
    if file is not None:
        if not file.is_file():
            raise ModelicaError(f"Modelica file {file} does not exist")
        digest.update(str(file.resolve()).encode())
        for path in dict.fromkeys((file, *library_files(model, file).values())):
            digest.update(path.name.encode() + path.read_bytes())
    return digest.hexdigest()


@cache
def _surroundings() -> str:
    """Content hash of library, compiler and linter, which stay the same while a process runs."""
    digest = hashlib.sha256(version("rumoca").encode())
    here = Path(__file__).parent
    own = (
        here / "worker.py",
        here / "closure.py",
        here / "rewrite.py",
        here / "algorithms.py",
        here.parent / "flat" / "slim.py",
        *sorted((here / "lint").glob("*.py")),
    )
    for path in (*sorted(library_root().rglob("*.mo")), *own):
        digest.update(path.name.encode() + path.read_bytes())
    return digest.hexdigest()
