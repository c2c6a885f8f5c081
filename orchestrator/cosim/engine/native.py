"""The C library of the engine, compiled at first use with the compiler of the machine and kept; and how copies of this process are told from it."""

import ctypes
import hashlib
import mmap
import os
import sys
import tempfile
from collections.abc import Sequence
from functools import cache
from pathlib import Path

import fmus.runtime
from fmus.children import run_tool
from fmus.errors import MisfitError
from fmus.files import cache_folder
from fmus.runtime.compiler import FLAGS, find_compiler, first_error

# `MADV_WIPEONFORK` of Linux: the page is full of zeros in a process that was forked off.
_WIPE_ON_FORK = 18


@cache
def _page() -> mmap.mmap | None:
    if sys.platform != "linux":
        return None
    page = mmap.mmap(-1, mmap.PAGESIZE, flags=mmap.MAP_PRIVATE | mmap.MAP_ANONYMOUS)
    try:
        page.madvise(_WIPE_ON_FORK)
    except OSError:  # a kernel before 4.14
        return None
    page[0] = 1
    return page


@cache
def own_process_address() -> int | None:
    """Address of a number that is 1 here and 0 in copies of this process; None where the system cannot tell."""
    page = _page()
    return None if page is None else ctypes.addressof(ctypes.c_int32.from_buffer(page))


def end_copies() -> None:
    """End this process if it is a copy that an FMU has made."""
    page = _page()
    if page is not None and page[0] == 0:
        os._exit(0)


_HERE = Path(__file__).parent
_LOOP = (_HERE / "loop.c", _HERE / "logger.c")
_HEADERS = (_HERE / "loop.h",)
_RUNTIME = Path(fmus.runtime.__file__).parent
_INTEGRATOR = tuple(
    _RUNTIME / f"{name}.c" for name in ("integrator", "dormand_prince", "rosenbrock", "crossing", "linear")
)
_INTEGRATOR_HEADERS = tuple(_RUNTIME / f"{name}.h" for name in ("integrator", "method", "linear"))


@cache
def native_library() -> ctypes.CDLL | None:
    """The loop and the loggers, or None where there is no C compiler."""
    try:
        return ctypes.CDLL(str(compile_native(_LOOP, _HEADERS)))
    except MisfitError:
        return None


@cache
def exchange_library() -> ctypes.CDLL:
    """The integrator of model exchange.

    Raises:
        MisfitError: without a C compiler.
    """
    sources = (_HERE / "exchange.c", _HERE / "loop.c", *_INTEGRATOR)
    return ctypes.CDLL(str(compile_native(sources, (*_HEADERS, *_INTEGRATOR_HEADERS))))


def compile_native(sources: Sequence[Path], headers: Sequence[Path]) -> Path:
    """Compile C files into a shared library, once for each content.

    Raises:
        MisfitError: without a C compiler, or if it fails.
    """
    # `-fvisibility=hidden` is for FMUs; here every function that is not static is meant to be called.
    flags = [flag for flag in FLAGS if not flag.startswith("-fvisibility")]
    texts = [path.read_text(encoding="utf-8") for path in (*sources, *headers)]
    # The compiler itself is part of the key by its name: looking for it would cost more than loading the library.
    key = hashlib.sha256("\0".join((os.environ.get("CC", ""), *flags, *texts)).encode()).hexdigest()
    target = cache_folder("compiled") / f"{key}.so"
    if target.is_file():
        return target
    compiler = find_compiler()
    includes = [f"-I{folder}" for folder in sorted({str(path.parent) for path in headers})]
    with tempfile.TemporaryDirectory(dir=target.parent) as folder:
        built = str(Path(folder) / "native.so")
        command = [*compiler, *flags, *includes, "-shared", "-o", built, *map(str, sources), "-lm"]
        done = run_tool(command)
        if done.returncode != 0:
            raise MisfitError(f"the C compiler failed: {first_error(done.stderr)}")
        os.replace(built, target)  # a concurrent build of the same content gives the same file
    return target
