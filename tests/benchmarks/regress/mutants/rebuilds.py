"""Harmless rebuilds: the same model with other compiler flags, solver tolerances and steps of the recorder."""

import itertools
import json
import os
import shutil
import subprocess
import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

from fmus.files import write_atomically
from tests.benchmarks.regress.mutants.cases import regress, write_case
from tests.benchmarks.regress.mutants.subjects import Subject
from tests.benchmarks.regress.mutants.workshop import Workshop, compiler_flags

PEERS = Path(__file__).parents[4] / "build/peers/bin/python"
# Name -> (which compiler, flags): what a colleague's machine or a release build may use.
BUILDS: dict[str, tuple[str, tuple[str, ...]]] = {
    "gcc-O0": ("gcc", ("-O0",)),
    "gcc-O1": ("gcc", ("-O1",)),
    "gcc-O2-native": ("gcc", ("-O2", "-march=native")),
    "gcc-O3": ("gcc", ("-O3",)),
    "gcc-O3-unroll": ("gcc", ("-O3", "-funroll-loops")),
    "gcc-Os": ("gcc", ("-Os",)),
    "clang-O0": ("clang", ("-O0",)),
    "clang-O2": ("clang", ("-O2",)),
}
TOLERANCES = (1e-6, 1e-7, 1e-9)
STEPS = (0.5, 1.0, 2.0)


def run_rebuilds(subject: Subject, folder: Path, workshop: Workshop) -> dict[str, dict]:
    """Return what misfit said about every rebuild of a subject, by name; kept in rebuilds.json.

    The folder has the subject's inputs.csv and reference.csv. Compilers that are not there are left out.
    """
    kept = folder / "rebuilds.json"
    if kept.is_file():
        return json.loads(kept.read_text())
    place = folder / "rebuilds"
    place.mkdir(exist_ok=True)
    cases = []
    for name, (compiler, flags) in BUILDS.items():
        command = find_compiler(compiler)
        if command is not None:
            if not (place / f"{name}.fmu").is_file():
                with _chosen(command), compiler_flags(flags):
                    workshop.build(subject, place / f"{name}.fmu")
            cases += _cases(subject, place, name)
    found = regress(cases, folder / "report.json")
    outcomes = {name: {"verdict": each["verdict"], "reason": each.get("reason", "")} for name, each in found.items()}
    write_atomically(kept, json.dumps(outcomes, indent=1).encode())
    return outcomes


def _cases(subject: Subject, place: Path, name: str) -> list[Path]:
    cases = []
    for tolerance, step in itertools.product(TOLERANCES, STEPS):
        case = f"{name}-{tolerance:g}-{step:g}"
        path = write_case(subject, place, case, step * subject.step_s, tolerance)
        path.write_text(path.read_text().replace(f'"{case}.fmu"', f'"{name}.fmu"'))
        cases.append(path)
    return cases


def find_compiler(name: str) -> Sequence[str] | None:
    """Return the command of gcc or clang, for clang also the one inside the `ziglang` package; None where there is none."""
    if shutil.which(name):
        return [name]
    for python in (sys.executable, str(PEERS)):
        if name == "clang" and Path(python).exists():
            asked = subprocess.run([python, "-c", "import ziglang"], capture_output=True, check=False)
            if asked.returncode == 0:
                return [python, "-m", "ziglang", "cc"]
    return None


@contextmanager
def _chosen(command: Sequence[str]) -> Iterator[None]:
    before = os.environ.get("CC")
    os.environ["CC"] = " ".join(command)
    try:
        yield
    finally:
        os.environ.pop("CC")
        if before is not None:
            os.environ["CC"] = before
