"""Diagnose cases by the command that users call, each in a process of its own; what is done already is kept."""

import json
import os
import resource
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

from fmus.files import write_atomically
from tests.benchmarks.diagnosis.truth.families import Wish, draw_case
from tests.benchmarks.diagnosis.truth.write import write_case


def answer_of(wish: Wish, out: Path) -> dict[str, Any]:
    """The answer of a case, whose files are made if they are not there."""
    file = out / "answers" / f"{wish.name}.json"
    if not file.exists():
        answer = write_case(draw_case(wish), out / "cases" / wish.name)
        write_json(file, answer)
    answer: dict[str, Any] = json.loads(file.read_text())
    return answer


def diagnosis_of(wish: Wish, out: Path, timeout_s: float) -> dict[str, Any]:
    """The result of `misfit diagnose` on a case; a run that fails or takes too long is a result with `failed`."""
    file = out / "results" / f"{wish.name}.json"
    if not file.exists():
        answer = answer_of(wish, out)
        write_json(file, _diagnose(answer["model"], out / "cases" / wish.name, timeout_s))
    result: dict[str, Any] = json.loads(file.read_text())
    return result


def _diagnose(model: str, folder: Path, timeout_s: float) -> dict[str, Any]:
    command = [sys.executable, "-m", "orchestrator.cli", "diagnose", model, str(folder)]
    environment = {**os.environ, "OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"}
    began, used = time.monotonic(), _children_cpu_s()
    try:
        done = subprocess.run(
            [*command, "--json", "-", "--quiet", "--workers", "1"],
            capture_output=True,
            text=True,
            timeout=timeout_s,
            env=environment,
        )
    except subprocess.TimeoutExpired:
        return {"failed": f"no result within {timeout_s:g} s", "seconds": timeout_s}
    seconds = time.monotonic() - began
    if done.returncode not in (0, 1):
        return {"failed": done.stderr.strip()[-2000:], "exit_code": done.returncode, "seconds": seconds}
    return {**json.loads(done.stdout), "wall_seconds": seconds, "cpu_seconds": _children_cpu_s() - used}


def _children_cpu_s() -> float:
    """Processor time of all child processes that have ended; this process runs one at a time."""
    usage = resource.getrusage(resource.RUSAGE_CHILDREN)
    return usage.ru_utime + usage.ru_stime


def write_json(file: Path, content: dict[str, Any]) -> None:
    """Write a file as a whole, so that an interrupted run leaves none that is half."""
    file.parent.mkdir(parents=True, exist_ok=True)
    write_atomically(file, (json.dumps(content, indent=1) + "\n").encode())
