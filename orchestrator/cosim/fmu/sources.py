"""The binary of an FMU that comes as sources, made with the C compiler of the machine and kept."""

import hashlib
from pathlib import Path

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
