"""Where an FMU lies unpacked, and its binary for this machine: found, compiled from its sources, or why there is none."""

import ctypes
import hashlib
import os
import platform
import struct
import sys
from collections.abc import Iterator
from pathlib import Path

from fmus.archive import extracted_once
from fmus.errors import FmuError
from fmus.files import cache_folder
from fmus.runtime.compiler import find_compiler
from fmus.sources import FLAGS, compile_library
from orchestrator.cosim.fmu.description import FmuDescription, Interface


def compile_sources(description: FmuDescription, interface: Interface, folder: Path) -> Path:
    """Compile the sources of an unpacked FMU into a shared library.

    Args:
        description: what the FMU says of itself.
        interface: the way it is run, with its sources.
        folder: where the FMU lies unpacked.

    Raises:
        FmuError: without a compiler, for sources that are not C, beyond limits of time and memory, or with the compiler's
            first error.
    """
    text = " ".join((*find_compiler(), *FLAGS, description.digest, interface.identifier))
    target = cache_folder("compiled") / f"{hashlib.sha256(text.encode()).hexdigest()}.so"
    if not target.is_file():
        name = description.path.name
        compile_library(name, description.version, interface.sources, folder / "sources", target)
    return target


_ENDINGS = {"linux": ".so", "darwin": ".dylib", "windows": ".dll"}
_ARCHITECTURES = {"amd64": "x86_64", "x86_64": "x86_64", "arm64": "aarch64", "aarch64": "aarch64"}
# e_machine of ELF headers
_ELF_MACHINES = {3: "x86", 40: "arm", 62: "x86_64", 183: "aarch64", 243: "riscv64"}
_loaded: dict[str, ctypes.CDLL] = {}


def system_name() -> str:
    """linux, darwin or windows."""
    return "windows" if sys.platform.startswith("win") else "darwin" if sys.platform == "darwin" else "linux"


def architecture() -> str:
    """Architecture of this machine as FMI 3 calls it."""
    return _ARCHITECTURES.get(platform.machine().lower(), platform.machine().lower())


def platform_folders(version: int) -> tuple[str, ...]:
    """Folders below `binaries/` that fit this machine, best first."""
    system, machine = system_name(), architecture()
    tuple3 = f"{machine}-{system}"
    old = {"linux": "linux64", "darwin": "darwin64", "windows": "win64"}[system]
    # FMI 2 has no name for other architectures; `darwin64` may be for both kinds of Mac.
    second = (old,) if machine == "x86_64" or system == "darwin" else ()
    return (tuple3,) if version == 3 else (*second, tuple3)


def unpacked(description: FmuDescription) -> Path:
    """Folder with the files of the FMU, unpacked once for each content."""
    folder = cache_folder("unpacked") / description.digest[:32]
    try:
        return extracted_once(description.path, folder)
    except OSError as error:
        raise FmuError(
            f"{description.path.name} cannot be unpacked into {folder.parent}: {error.strerror or error}; "
            "free some space, or set MISFIT_CACHE to another folder"
        ) from error


def load_binary(description: FmuDescription, interface: Interface) -> ctypes.CDLL:
    """Load the shared library of an FMU; it stays loaded until the process ends, one for all instances.

    Raises:
        FmuError: if there is none for this machine and no sources, or it cannot be loaded; the message says which.
    """
    path = find_binary(description, interface)
    if str(path) not in _loaded:
        _loaded[str(path)] = _open(description, path)
    return _loaded[str(path)]


def find_binary(description: FmuDescription, interface: Interface) -> Path:
    """The shared library for this machine; compiled from the sources where the FMU brings no binary for it."""
    folder = unpacked(description)
    name = interface.identifier + _ENDINGS[system_name()]
    folders = platform_folders(description.version)
    for place in folders:
        binary = folder / "binaries" / place / name
        if binary.is_file():
            return binary
    if interface.sources:
        return compile_sources(description, interface, folder)
    fmu, has = description.path.name, sorted(_binaries(folder))
    if interface.needs_execution_tool:
        tool = f" ({description.tool})" if description.tool else ""
        raise FmuError(
            f"{fmu} needs its tool{tool} to run, and has no binary for {folders[0]}; install the tool or export without it"
        )
    if has:
        raise FmuError(
            f"{fmu} has no binary {name} for {folders[0]}, and no sources; it has {', '.join(has)}; export it for this platform"
        )
    raise FmuError(f"{fmu} has neither binaries nor sources; export it with one of them")


def _binaries(folder: Path) -> Iterator[str]:
    for path in (folder / "binaries").glob("*/*"):
        if path.is_file():
            yield f"{path.parent.name}/{path.name}"


def _open(description: FmuDescription, path: Path) -> ctypes.CDLL:
    fmu = description.path.name
    wrong = _wrong_architecture(path)
    if wrong:
        raise FmuError(
            f"{fmu}: {path.name} is built for {wrong}, this machine is {architecture()}-{system_name()}; export it anew"
        )
    try:
        # Its neighbours may be linked without a path to find them.
        return ctypes.CDLL(str(path), mode=getattr(os, "RTLD_NOW", 2) | getattr(os, "RTLD_LOCAL", 0))
    except OSError as error:
        words = str(error)
        if "cannot open shared object file" in words and not words.startswith(str(path)):
            missing = words.split(":")[0]
            raise FmuError(
                f"{fmu}: {path.name} needs the library {missing}, which is not installed; install it"
            ) from error
        if "undefined symbol" in words:
            symbol = words.rpartition("undefined symbol:")[2].strip()
            raise FmuError(
                f"{fmu}: {path.name} uses {symbol}, which no library provides; ask its maker to link it"
            ) from error
        raise FmuError(f"{fmu}: {path.name} cannot be loaded: {words.rpartition(': ')[2]}") from error


def _wrong_architecture(path: Path) -> str | None:
    """What a Linux binary was built for when that is not this machine."""
    head = path.read_bytes()[:20]
    if system_name() != "linux":
        return None
    if head[:4] != b"\x7fELF" or len(head) < 20:
        kinds = {b"MZ": "Windows", b"\xcf\xfa": "macOS", b"\xca\xfe": "macOS"}
        return kinds.get(head[:2], "no platform that is known here (not an ELF file)")
    bits = {1: 32, 2: 64}.get(head[4], 0)
    (machine,) = struct.unpack("<H" if head[5] == 1 else ">H", head[18:20])
    built = _ELF_MACHINES.get(machine, f"machine number {machine}")
    fits = built == architecture() and bits == 8 * struct.calcsize("P")
    return None if fits else f"{built}-linux with {bits} bits"
