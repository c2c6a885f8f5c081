"""Platforms that binaries can be built for on any machine, with the Zig compiler of the wheel `ziglang`."""

import importlib.util
import os
import tempfile
from collections.abc import Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from importlib.metadata import version
from pathlib import Path

from fmus.children import child_environment, python_command, run_tool
from fmus.errors import FmuError
from fmus.files import cache_folder
from fmus.runtime.compiler import CODE_FLAGS, first_error, write_sources


@dataclass(frozen=True)
class Platform:
    """A platform: its name in FMI 3.0, which is that of its folder, and its folder in FMI 2.0."""

    name: str
    folder2: str
    target: str  # as Zig calls it; the number is that of the oldest C library that will do
    ending: str


PLATFORMS = {
    platform.name: platform
    for platform in (
        Platform("x86_64-linux", "linux64", "x86_64-linux-gnu.2.17", ".so"),
        # FMI 2.0 has no name of its own for this one.
        Platform("aarch64-linux", "aarch64-linux", "aarch64-linux-gnu.2.17", ".so"),
        Platform("x86_64-windows", "win64", "x86_64-windows-gnu", ".dll"),
        Platform("x86_64-darwin", "darwin64", "x86_64-macos", ".dylib"),
        Platform("aarch64-darwin", "darwin64", "aarch64-macos", ".dylib"),
    )
}
_ALIASES = {
    "linux64": "x86_64-linux",
    "win64": "x86_64-windows",
    "darwin64": "x86_64-darwin",
    "darwin-aarch64": "aarch64-darwin",
}
_CPU_TYPES = {"x86_64-darwin": (0x01000007, 3), "aarch64-darwin": (0x0100000C, 0)}


def find_platforms(names: str) -> tuple[Platform, ...]:
    """The platforms of a list with commas, each once; FMI 2.0 names mean the x86_64 ones.

    Raises:
        FmuError: if a name is unknown, or if the Zig compiler is not installed.

    Example:
        >>> find_platforms("osx")
        Traceback (most recent call last):
            ...
        fmus.errors.FmuError: platform 'osx' is unknown; choose from x86_64-linux, aarch64-linux, x86_64-windows, x86_64-darwin, aarch64-darwin
    """
    found = {}
    for name in (part.strip() for part in names.split(",")):
        platform = PLATFORMS.get(_ALIASES.get(name, name))
        if platform is None:
            raise FmuError(f"platform {name!r} is unknown; choose from {', '.join(PLATFORMS)}")
        found[platform.name] = platform
    if importlib.util.find_spec("ziglang") is None:
        raise FmuError(
            "building for other platforms needs the Zig compiler; get it with: pip install 'misfit-fmu[platforms]'"
        )
    return tuple(found.values())


def zig_version() -> str:
    """Version of the Zig compiler."""
    return version("ziglang")


def cross_compile(
    sources: Mapping[str, str], platforms: Sequence[Platform], units: Sequence[str] = ()
) -> dict[Platform, bytes]:
    """Compile C sources (file name -> text) to a shared library for each platform, at the same time.

    Args:
        sources: all files.
        platforms: what to compile for.
        units: those to compile, where other `.c` files are only included by them.

    Raises:
        FmuError: with the first error of the compiler.
    """
    with ThreadPoolExecutor(os.cpu_count() or 1) as pool:
        libraries = list(pool.map(lambda platform: _compile(sources, platform, units), platforms))
    return dict(zip(platforms, libraries, strict=True))


def universal(libraries: Mapping[Platform, bytes]) -> bytes:
    """One file with the libraries of both kinds of Mac, as FMI 2.0 wants it; a single one stays as it is.

    The format is that of `fat_header` and `fat_arch` in Apple's `mach-o/fat.h`: big-endian, slices at multiples of 2^14.
    """
    if len(libraries) == 1:
        return next(iter(libraries.values()))
    header = b"".join(number.to_bytes(4, "big") for number in (0xCAFEBABE, len(libraries)))
    content, offset = b"", 1 << 14
    for platform, library in libraries.items():
        kind, subtype = _CPU_TYPES[platform.name]
        header += b"".join(number.to_bytes(4, "big") for number in (kind, subtype, offset, len(library), 14))
        content += library + bytes(-len(library) % (1 << 14))
        offset = (1 << 14) + len(content)
    return header + bytes((1 << 14) - len(header)) + content


def _compile(sources: Mapping[str, str], platform: Platform, chosen: Sequence[str]) -> bytes:
    with tempfile.TemporaryDirectory(prefix="misfit-zig-") as folder:
        found = write_sources(sources, Path(folder))
        units = list(chosen) or found
        command = python_command("ziglang", "cc", "-target", platform.target, *CODE_FLAGS)
        command += [
            "-shared",
            "-s",
            "-o",
            f"model{platform.ending}",
            *units,
            *([] if platform.ending == ".dll" else ["-lm"]),
        ]
        cache = str(cache_folder("zig"))
        # The compiler writes next to what it makes, and keeps what it made of the C library in its cache.
        environment = child_environment(ZIG_GLOBAL_CACHE_DIR=cache, ZIG_LOCAL_CACHE_DIR=str(Path(folder) / "cache"))
        result = run_tool(command, folder=Path(folder), environment=environment)
        if result.returncode != 0:
            raise FmuError(f"Zig cannot compile the model for {platform.name}: {first_error(result.stderr)}")
        return (Path(folder) / f"model{platform.ending}").read_bytes()
