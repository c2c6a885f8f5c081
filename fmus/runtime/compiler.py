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
FLAGS = (
    "-std=c99",
    "-O2",
    "-fPIC",
    "-shared",
    "-fvisibility=hidden",
    "-ffp-contract=off",
    "-fno-math-errno",
    "-fno-trapping-math",
)


def compile_library(sources: Mapping[str, str]) -> bytes:
    """Compile the `.c` files among `sources` (file name -> text) into one shared library.

    Raises:
        FmuError: without a C compiler, or with the first error of the compiler.
    """
    compiler = find_compiler()
    with tempfile.TemporaryDirectory(prefix="misfit-build-") as folder:
        for name, text in sources.items():
            (Path(folder) / name).write_text(text, encoding="utf-8")
        # Relative names keep the folder out of the library, which makes builds repeatable.
        units = sorted(name for name in sources if name.endswith(".c"))
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
            raise FmuError(f"{compiler[0]} cannot compile the model: {_first_error(result.stderr)}")
        return (Path(folder) / "model.so").read_bytes()


def find_compiler() -> list[str]:
    """Give the command of the C compiler: `$CC` where set, else `cc` or `gcc`."""
    chosen = shlex.split(os.environ.get("CC", ""))
    candidates = [chosen] if chosen else [["cc"], ["gcc"]]
    for command in candidates:
        if shutil.which(command[0]):
            return command
    names = " or ".join(command[0] for command in candidates)
    raise FmuError(f"no C compiler found (looked for {names}); install gcc, or set CC to a compiler")


def _first_error(stderr: str) -> str:
    lines = [line.strip() for line in stderr.splitlines() if line.strip()]
    errors = [line for line in lines if "error" in line]
    return (errors or lines or ["no message"])[0]
