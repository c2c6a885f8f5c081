"""Regression cases of a subject, and what `misfit regress` says about them."""

import json
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from tests.benchmarks.regress.mutants.subjects import RELATIVE, Subject

MISFIT = Path(sys.executable).with_name("misfit")
SOLVER_TOLERANCE = 1e-8


def write_inputs(subject: Subject, file: Path) -> None:
    """Write what drives a subject as CSV."""
    time, columns = subject.input_table()
    rows = np.column_stack([time, *columns.values()])
    header = ",".join(["time", *columns])
    np.savetxt(file, rows, fmt="%.9g", delimiter=",", header=header, comments="")


def write_case(
    subject: Subject, folder: Path, name: str, step_s: float | None = None, tolerance: float = SOLVER_TOLERANCE
) -> Path:
    """Write the case NAME of the FMU NAME.fmu into a folder that has inputs.csv and reference.csv above it."""
    lines = [
        f'model = "{name}.fmu"',
        'reference = "../reference.csv"',
        "[run]",
        f"stop = {subject.stop_s}",
        f"step = {step_s or subject.step_s}",
        f"tolerance = {tolerance}",
        'interface = "CoSimulation"',
        "[inputs]",
        'file = "../inputs.csv"',
        "[limits]",
        "seconds = 60.0",
        "patience_s = 20.0",
    ]
    for output, absolute in subject.outputs.items():
        lines += [f'[signals."{output}"]', f"absolute = {absolute}", f"relative = {RELATIVE}"]
    path = folder / f"{name}.regress.toml"
    path.write_text("\n".join(lines) + "\n")
    return path


def regress(cases: Sequence[Path], report: Path, *options: str) -> dict[str, dict]:
    """Run cases with `misfit regress` and return their outcomes by name.

    Raises:
        RuntimeError: if the command itself gives no report.
    """
    command = [str(MISFIT), "regress", *map(str, cases), "--json", str(report), "--quiet", "--workers", "2", *options]
    report.unlink(missing_ok=True)
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    if done.returncode not in (0, 1, 3) or not report.is_file():
        raise RuntimeError(f"misfit regress ended with {done.returncode}: {done.stderr.strip()[-300:]}")
    return {case["name"]: case for case in json.loads(report.read_text())["cases"]}
