"""OpenModelica's compiler as a second front end: the script that it runs, and the results that it writes."""

import csv
import json
import subprocess
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from oracle_cases import POINTS, Case

TIME_LIMIT_S = 600


def omc_script(library: Path, cases: Sequence[Case], wrappers: Path) -> str:
    """A script that loads the library and the wrapping models and simulates each case to `caseN_res.csv`.

    Functions of OpenModelica.Scripting; the log of each call follows it, so that a refusal can be read.
    """
    lines = [f"loadFile({_quoted(library / 'FESArm' / 'package.mo')});", "getErrorString();"]
    lines += [f"loadFile({_quoted(wrappers)});", "getErrorString();"]
    for i, case in enumerate(cases):
        lines += [
            f"simulate({case.simulated}, startTime=0.0, stopTime={case.stop!r}, numberOfIntervals={POINTS}, "
            f'tolerance=1e-10, method="dassl", fileNamePrefix="case{i}", outputFormat="csv", '
            'simflags="-noEventEmit");',
            "getErrorString();",
        ]
    return "\n".join(lines) + "\n"


def read_omc_csv(text: str, stop: float) -> dict[str, list[float]]:
    """Numbers by name at POINTS + 1 times from 0 to `stop`.

    At an event a time occurs twice, before and after; values from after it count. Columns of strings are left out.

    Raises:
        ValueError: if one of the times is missing.
    """
    header, *rows = list(csv.reader(text.splitlines()))
    times = np.array([float(row[0]) for row in rows])
    chosen = []
    for time in np.linspace(0.0, stop, POINTS + 1):
        near = np.flatnonzero(np.abs(times - time) < 1e-6 * stop / POINTS)
        if not near.size:
            raise ValueError(f"no row for t = {time:.9g} s; the file has {len(rows)} rows up to {times[-1]:.9g} s")
        chosen.append(rows[near[-1]])
    columns = dict(zip(header, zip(*chosen, strict=True), strict=True))
    return {name: [float(value) for value in column] for name, column in columns.items() if _are_numbers(column)}


def run_omc(omc: str, library: Path, cases: Sequence[Case], folder: Path) -> list[dict[str, list[float]]]:
    """Simulate all cases in `folder`; AssertionError with OpenModelica's log for one that has no result."""
    (folder / "wrappers.mo").write_text("".join(case.source or "" for case in cases))
    (folder / "run.mos").write_text(omc_script(library, cases, folder / "wrappers.mo"))
    done = subprocess.run(
        [omc, "run.mos"], cwd=folder, capture_output=True, text=True, timeout=TIME_LIMIT_S, check=False
    )
    results = []
    for i, case in enumerate(cases):
        file = folder / f"case{i}_res.csv"
        assert file.is_file(), f"{case.simulated} has no result:\n{done.stdout[-4000:]}{done.stderr[-2000:]}"
        results.append(read_omc_csv(file.read_text(), case.stop))
    return results


def _quoted(path: Path) -> str:
    return json.dumps(path.as_posix())


def _are_numbers(column: Sequence[str]) -> bool:
    try:
        return [float(value) for value in column] != []
    except ValueError:
        return False
