"""Case files for tests around the small FMUs of tests/cosim."""

import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1] / "cosim"))

from small_fmus import small_fmu  # noqa: E402

from tests.in_process import misfit_here  # noqa: E402

MISFIT = str(Path(sys.executable).with_name("misfit"))


def fmu(folder: Path, name: str, *, to: str = "", **options) -> Path:
    """A small FMU in a folder, as NAME.fmu or by another name."""
    return Path(shutil.copy(small_fmu(name, **options), folder / f"{to or name}.fmu"))


def case_file(folder: Path, name: str, text: str) -> Path:
    """A case file in a folder."""
    path = folder / f"{name}.regress.toml"
    path.write_text(text)
    return path


def decay_reference(path: Path, rate: float = 1.0, stop: float = 2.0, step: float = 0.01) -> Path:
    """The closed form exp(-rate t) of the FMU `decay` as a reference."""
    time = np.arange(round(stop / step) + 1) * step
    rows = "\n".join(f"{t!r},{x!r}" for t, x in zip(time.tolist(), np.exp(-rate * time).tolist(), strict=True))
    path.write_text(f"time,x\n{rows}\n")
    return path


def misfit(*arguments: object, folder: Path) -> "subprocess.CompletedProcess[str]":
    """`misfit regress` in a folder."""
    return misfit_here("regress", *arguments, folder=folder)
