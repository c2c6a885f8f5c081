"""`make bench-fmus FMUS=FOLDER`: every FMU and system structure of a folder through the gate, and the page with the results.

Each folder directly below FOLDER is a source, called NAME or NAME@VERSION. None of the files is shipped.
"""

import argparse
import hashlib
import json
import os
import subprocess
import time
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

from fmus.children import child_environment, python_command, run_child
from fmus.errors import MisfitError
from tests.benchmarks.fmus.page import TRIED, page

ONE_S = 150.0


def main() -> None:
    """Run the gate."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--report", type=Path, default=Path("docs/benchmarks/fmus.md"))
    parser.add_argument("--workers", type=int, default=os.cpu_count() or 1)
    parser.add_argument("--budget", type=float, default=float("inf"), help="s after which nothing further begins")
    given = parser.parse_args()
    os.environ.setdefault("MISFIT_CACHE", str(Path("build/bench-fmus").absolute()))
    began = time.monotonic()
    fmus, systems = distinct(given.folder, (".fmu",)), distinct(given.folder, (".ssp", ".ssd"))

    def within(path: Path) -> dict[str, Any] | None:
        return None if time.monotonic() - began > given.budget else gate(path, given.folder)

    with ThreadPoolExecutor(given.workers) as pool:
        rows = [row for row in pool.map(within, fmus) if row is not None]
    structures = [read(path, given.folder) for path in systems]
    given.report.write_text(page(rows, structures, skipped=len(fmus) - len(rows)))
    print(f"{len(rows)} FMUs and {len(structures)} system structures: {given.report}")


def distinct(folder: Path, endings: Sequence[str]) -> list[Path]:
    """Files with these endings, each content once."""
    found: dict[str, Path] = {}
    for path in sorted(folder.rglob("*")):
        if path.suffix.lower() in endings and path.is_file():
            found.setdefault(hashlib.sha256(path.read_bytes()).hexdigest(), path)
    return list(found.values())


def gate(path: Path, folder: Path) -> dict[str, Any]:
    """What became of an FMU."""
    row: dict[str, Any] = {"source": path.relative_to(folder).parts[0], "file": path.name}
    command = python_command("tests.benchmarks.fmus.one:main", str(path.resolve()))
    ended = ""
    try:
        done = run_child(command, environment=child_environment(), timeout_s=ONE_S)
        output = done.stdout
        if done.returncode != 0:  # where the gate does not set an FMU apart, it can end the process
            words = done.stderr.decode(errors="replace").strip().splitlines() or [f"exit code {done.returncode}"]
            ended = f"it ended the process: {words[-1]}"
    except subprocess.TimeoutExpired as error:
        output, ended = error.stdout or b"", f"no end within the {ONE_S:g} s of the gate"
    said = output.decode(errors="replace").replace(f"{folder.resolve()}/", "")  # no page names a place of this machine
    answers = [line for line in said.splitlines() if line.startswith("{")]
    found = dict(json.loads(answers[-1])) if answers else {}
    if ended:
        found[next((name for name in TRIED if name not in found), TRIED[-1])] = ended
    return row | found


def read(path: Path, folder: Path) -> dict[str, Any]:
    """Whether a system structure is read, or why not."""
    from orchestrator.cosim.load import load_system

    row = {"source": path.relative_to(folder).parts[0], "file": path.name}
    try:
        system = load_system(str(path))
        return {**row, "read": "ok", "components": len(system.components)}
    except MisfitError as error:
        return {**row, "read": " ".join(str(error).replace(f"{folder}/", "").split())}
    except Exception as error:  # what should not be: it stands in the table as it is
        return {**row, "read": f"INTERNAL {type(error).__name__}: {error}"}


if __name__ == "__main__":
    main()
