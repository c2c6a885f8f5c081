"""C sources to a shared library, with the compiler of the machine."""

import hashlib
import os
import re
import shlex
import shutil
import tempfile
from collections.abc import Collection, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

from fmus.children import run_tool
from fmus.errors import FmuError
from fmus.files import cache_folder, write_atomically

# Contracted multiply-adds would make results depend on the machine that compiled; nobody reads errno or traps.
CODE_FLAGS = (
    "-std=c99",
    "-O2",
    "-fvisibility=hidden",
    "-ffp-contract=off",
    "-fno-math-errno",
    "-fno-trapping-math",
)
FLAGS = ("-fPIC", *CODE_FLAGS)
_INCLUDE = re.compile(r'^\s*#\s*include\s*"([^"]+)"', re.MULTILINE)


def compile_library(sources: Mapping[str, str], shared: Collection[str] = ()) -> bytes:
    """Compile the `.c` files among `sources` (file name -> text) into one shared library, once for each content.

    Flags in `CFLAGS` come after ours, so they have the last word.

    Args:
        sources: all C files and headers.
        shared: files that other libraries have as well; what is made of such files alone is compiled once for all of them.

    Raises:
        FmuError: without a C compiler, or with the first error of the compiler.
    """
    command = [*find_compiler(), *FLAGS, *shlex.split(os.environ.get("CFLAGS", ""))]
    kept = cache_folder("compiled") / f"fmu-{_digest(*command, repr(sorted(sources.items())))}.so"
    if not kept.is_file():
        write_atomically(kept, _compiled(command, sources, shared))
    return kept.read_bytes()


def _compiled(command: Sequence[str], sources: Mapping[str, str], shared: Collection[str]) -> bytes:
    with tempfile.TemporaryDirectory(prefix="misfit-build-") as folder:
        units = write_sources(sources, Path(folder))
        # The model's own functions take as long as all the rest, so they come first.
        ordered = sorted(units, key=lambda unit: -len(sources[unit]))
        with ThreadPoolExecutor(os.cpu_count() or 1) as pool:
            list(pool.map(lambda unit: _compile(command, unit, sources, folder, shared), ordered))
        _run([*command, "-shared", "-o", "model.so", *(f"{unit}.o" for unit in units), "-lm"], folder)
        return (Path(folder) / "model.so").read_bytes()


def _compile(
    compiler: Sequence[str], unit: str, sources: Mapping[str, str], folder: str, shared: Collection[str]
) -> None:
    command = [*compiler, "-c", unit, "-o", f"{unit}.o"]
    needed = _included(unit, sources)
    if not needed.issubset(shared):
        return _run(command, folder)
    texts = [f"{name}\n{sources[name]}" for name in sorted(needed)]
    kept, made = cache_folder("objects") / f"{_digest(*command, *texts)}.o", Path(folder) / f"{unit}.o"
    if kept.is_file():
        made.write_bytes(kept.read_bytes())
    else:
        _run(command, folder)
        write_atomically(kept, made.read_bytes())


def _included(unit: str, sources: Mapping[str, str]) -> set[str]:
    """A file with all that it includes of the sources."""
    found, left = {unit}, [unit]
    while left:
        new = {name for name in _INCLUDE.findall(sources[left.pop()]) if name in sources} - found
        found |= new
        left += new
    return found


def _digest(*texts: str) -> str:
    return hashlib.sha256("\0".join(texts).encode()).hexdigest()


def _run(command: Sequence[str], folder: str) -> None:
    result = run_tool(command, folder=Path(folder))
    if result.returncode != 0:
        raise FmuError(f"{command[0]} cannot compile the model: {first_error(result.stderr)}")


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
