"""C sources to a shared library, with the compiler of the machine."""

import os
import shlex
import shutil
import subprocess
import tempfile
from collections.abc import Mapping
from pathlib import Path

from fmus.errors import FmuError

# Contracted multiply-adds would make results depend on the machine that compiled; nobody reads errno or traps.
CODE_FLAGS = (
    "-std=c99",
    "-O2",
    "-shared",
    "-fvisibility=hidden",
    "-ffp-contract=off",
    "-fno-math-errno",
    "-fno-trapping-math",
)
FLAGS = ("-fPIC", *CODE_FLAGS)


def compile_library(sources: Mapping[str, str]) -> bytes:
    """Compile the `.c` files among `sources` (file name -> text) into one shared library.

    Raises:
        FmuError: without a C compiler, or with the first error of the compiler.
    """
    compiler = find_compiler()
    with tempfile.TemporaryDirectory(prefix="misfit-build-") as folder:
        units = write_sources(sources, Path(folder))
        command = [*compiler, *FLAGS, "-o", "model.so", *units, "-lm"]
        result = subprocess.run(
            command,
            cwd=folder,
            capture_output=True,
            text=True,
            errors="replace",
            check=False,
        )
        if result.returncode != 0:
            raise FmuError(f"{compiler[0]} cannot compile the model: {first_error(result.stderr)}")
        return (Path(folder) / "model.so").read_bytes()


def write_sources(sources: Mapping[str, str], folder: Path) -> list[str]:
    """Write sources to a folder and list those to compile: relative names keep the folder out of the library."""
    for name, text in sources.items():
        (folder / name).write_text(text, encoding="utf-8")
    return sorted(name for name in sources if name.endswith(".c"))


def find_compiler() -> list[str]:
    """Give the command of the C compiler: `$CC` where set, else `cc` or `gcc`."""
    chosen = shlex.split(os.environ.get("CC", ""))
    candidates = [chosen] if chosen else [["cc"], ["gcc"]]
    for command in candidates:
        if shutil.which(command[0]):
            return command
    names = " or ".join(command[0] for command in candidates)
    raise FmuError(f"no C compiler found (looked for {names}); install gcc, or set CC to a compiler")


def first_error(stderr: str) -> str:
    """The first line of a compiler's messages that speaks of an error."""
    lines = [line.strip() for line in stderr.splitlines() if line.strip()]
    errors = [line for line in lines if "error" in line]
    return (errors or lines or ["no message"])[0]
