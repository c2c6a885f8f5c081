"""Diagnose cases by the command that users call, each in a process of its own; what is done already is kept."""

import json
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

from fmus.files import write_atomically
from tests.benchmarks.diagnosis.child import run_child
from tests.benchmarks.diagnosis.truth.experiment import Advice, write_with_experiment
from tests.benchmarks.diagnosis.truth.families import Wish, draw_case
from tests.benchmarks.diagnosis.truth.native import TruthError
from tests.benchmarks.diagnosis.truth.write import write_case

# Large, and nothing that is scored.
_LEFT_OUT = ("curves", "where", "latent_forces", "findings")


def answer_of(wish: Wish, out: Path) -> dict[str, Any]:
    """The answer of a case, whose files are made if they are not there."""
    return _kept(out / "answers" / f"{wish.name}.json", lambda: write_case(draw_case(wish), out / "cases" / wish.name))


def diagnosis_of(wish: Wish, out: Path, limit_s: float) -> dict[str, Any]:
    """The result of `misfit diagnose` on a case; a run that fails or takes too long is a result with `failed`."""
    model = answer_of(wish, out)["model"]
    name = wish.name
    return _kept(out / "results" / f"{name}.json", lambda: diagnose_folder(model, out / "cases" / name, out, limit_s))


def diagnosis_after_experiment(wish: Wish, out: Path, limit_s: float) -> dict[str, Any] | None:
    """The result once the recommended experiment has been run on the true machine, and learned from beside the rest.

    Returns:
        None if the first diagnosis recommends no experiment.
    """
    first, name = diagnosis_of(wish, out, limit_s), wish.name
    table = out / "experiments" / f"{name}.csv"
    if first.get("next_experiment") is None or not table.exists():
        return None

    def again() -> dict[str, Any]:
        planned = first["next_experiment"]
        start = (planned.get("start_scale", 1.0), planned.get("start_offset", 0.0))
        advice = Advice(table, planned.get("experiment") == "repeat", *start)
        folder = out / "cases" / f"{name}_again"
        try:
            write_with_experiment(draw_case(wish), folder, advice)
        except TruthError as error:
            return {"failed": f"the machine does not survive the recommended experiment: {error}"}
        return diagnose_folder(answer_of(wish, out)["model"], folder, out, limit_s)

    return _kept(out / "again" / f"{name}.json", again)


def diagnose_folder(model: str, folder: Path, out: Path, limit_s: float) -> dict[str, Any]:
    """The result of `misfit diagnose` on a folder; one that fails or takes too long has `failed`."""
    result, experiment = out / "raw" / f"{folder.name}.json", out / "experiments" / f"{folder.name}.csv"
    for file in (result, experiment):
        file.parent.mkdir(parents=True, exist_ok=True)
        file.unlink(missing_ok=True)
    command = [sys.executable, "-m", "orchestrator.cli", "diagnose", model, str(folder), "--quiet", "--workers", "1"]
    files = ["--json", str(result), "--experiment", str(experiment)]
    ended = run_child([*command, *files], limit_s, out / "logs" / f"{folder.name}.txt")
    used = {"wall_seconds": ended.wall_s, "cpu_seconds": ended.cpu_s, "peak_mb": ended.peak_mb}
    if ended.code is None:
        return {"failed": f"no result within {limit_s:g} s", **used}
    if ended.code not in (0, 1) or not result.exists():
        return {"failed": ended.said or f"it says nothing and ends with {ended.code}", "exit_code": ended.code, **used}
    found = json.loads(result.read_text())
    result.unlink()
    return {key: value for key, value in found.items() if key not in _LEFT_OUT} | used


def _kept(file: Path, make: Callable[[], dict[str, Any]]) -> dict[str, Any]:
    """The content of a file, which is made where it is not there."""
    if not file.exists():
        write_json(file, make())
    found: dict[str, Any] = json.loads(file.read_text())
    return found


def write_json(file: Path, content: dict[str, Any]) -> None:
    """Write a file as a whole, so that an interrupted run leaves none that is half."""
    file.parent.mkdir(parents=True, exist_ok=True)
    write_atomically(file, (json.dumps(content, indent=1) + "\n").encode())
