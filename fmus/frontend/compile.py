"""Compile a Modelica class to its flat DAE, in a child process, and keep the result."""

import hashlib
import json
import shutil
import subprocess
import tempfile
from functools import cache
from importlib.metadata import version
from pathlib import Path
from typing import Any

from fmus.children import child_environment, python_command, run_child
from fmus.errors import ModelicaError
from fmus.files import cache_folder, write_atomically
from fmus.frontend.lint import check_units, lint_class
from fmus.frontend.messages import explained
from fmus.library import library_root

TIME_LIMIT_S = 120.0


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
    root = library_root()
    source = root / "FESArm" / "package.mo" if file is None else file
    kept = kept_dae(model, file)
    if kept.is_file():
        return json.loads(kept.read_text())
    lint_class(model, file, [root])
    return keep_dae(kept, _compiled(model, source, root))


def kept_dae(model: str, file: Path | None) -> Path:
    """Where the flat DAE of a class is kept."""
    return cache_folder("dae") / f"{fingerprint(model, file)}.json"


def keep_dae(kept: Path, text: str) -> dict[str, Any]:
    """Check the units of a compiled class and keep it.

    Raises:
        ModelicaError: if they do not agree.
    """
    dae: dict[str, Any] = json.loads(text)
    check_units(dae)
    write_atomically(kept, text.encode())
    return dae


def _compiled(model: str, source: Path, root: Path) -> str:
    if (source.parent / "package.mo").exists():
        return _run_compiler(model, source, root)
    with tempfile.TemporaryDirectory() as folder:
        # The compiler reads all files beside the one it is given, and unrelated ones may contradict it.
        alone = Path(folder) / source.name
        shutil.copyfile(source, alone)
        return _run_compiler(model, alone, root)


def _run_compiler(model: str, source: Path, root: Path) -> str:
    command = python_command("fmus.frontend.worker", model, str(source), str(root))
    try:
        done = run_child(command, environment=child_environment(), timeout_s=TIME_LIMIT_S)
    except subprocess.TimeoutExpired:
        raise ModelicaError(f"compiling {model} took longer than {TIME_LIMIT_S:.0f} s; simplify the class") from None
    if done.returncode == 2:
        raise ModelicaError(explained(done.stderr.decode(errors="replace"), model, source, [root]))
    if done.returncode != 0:
        raise ModelicaError(f"the Modelica compiler crashed on {model} (exit {done.returncode}); check {source.name}")
    return done.stdout.decode()


def fingerprint(model: str, file: Path | None = None) -> str:
    """Content hash of all that a class is compiled from: its sources, the library, the compiler and the linter.

    Raises:
        ModelicaError: if the file does not exist.
    """
    digest = hashlib.sha256(f"{_surroundings()} {model}".encode())
    if file is not None:
        if not file.is_file():
            raise ModelicaError(f"Modelica file {file} does not exist")
        # A class in a package folder may use its neighbours.
        neighbours = sorted(file.parent.rglob("*.mo")) if (file.parent / "package.mo").exists() else []
        digest.update(str(file.resolve()).encode())
        for path in (file, *neighbours):
            digest.update(path.name.encode() + path.read_bytes())
    return digest.hexdigest()


@cache
def _surroundings() -> str:
    """Content hash of library, compiler and linter, which stay the same while a process runs."""
    digest = hashlib.sha256(version("rumoca").encode())
    here = Path(__file__).parent
    own = (here / "worker.py", here.parent / "flat" / "model.py", *sorted((here / "lint").glob("*.py")))
    for path in (*sorted(library_root().rglob("*.mo")), *own):
        digest.update(path.name.encode() + path.read_bytes())
    return digest.hexdigest()
