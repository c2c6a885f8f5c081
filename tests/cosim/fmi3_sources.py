"""FMUs of FMI 3.0 that are one C file of this folder's `fmus`, with FMPy's headers."""

import subprocess
import zipfile
from pathlib import Path

import fmpy

from fmus.runtime.compiler import find_compiler

HEADERS = Path(fmpy.__file__).parent / "c-code"
FLAGS = ["-DFMI3_OVERRIDE_FUNCTION_PREFIX", f"-I{HEADERS}", "-shared", "-fPIC", "-O1"]


def fmi3_of(name: str, description: str, folder: Path) -> Path:
    """Build `NAME.fmu` in a folder from `fmus/NAME.c` and the text of its model description."""
    source = Path(__file__).parent / "fmus" / f"{name}.c"
    subprocess.run([*find_compiler(), *FLAGS, "-o", f"{name}.so", str(source)], cwd=folder, check=True)
    with zipfile.ZipFile(folder / f"{name}.fmu", "w") as archive:
        archive.writestr("modelDescription.xml", description)
        archive.write(folder / f"{name}.so", f"binaries/x86_64-linux/{name}.so")
    return folder / f"{name}.fmu"
