"""Runs after runs in one process leave nothing behind: no memory, no objects, no open files, no child processes."""

import json
import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

ROOT = Path(__file__).parents[2]
RUNS = Path(__file__).with_name("runs.py")


def left_by(kind: str, folder: Path, warm: int, runs: int) -> list[Any]:
    """Growth of the heap in KiB, of objects and of blocks, and what is still open."""
    command = [sys.executable, str(RUNS), kind, str(folder), str(warm), str(runs)]
    path = os.pathsep.join(map(str, (RUNS.parent, ROOT)))
    done = subprocess.run(
        command, stdout=subprocess.PIPE, text=True, check=True, env={**os.environ, "PYTHONPATH": path}
    )
    return list(json.loads(done.stdout))


@pytest.mark.parametrize("kind", ["parts", "one FMU"])
def test_1000_runs_leave_nothing_behind(kind: str, tmp_path: Path) -> None:
    heap, objects, blocks, still_open = left_by(kind, tmp_path, 100, 1000)

    # 32 bytes a run: less than any instance, state or table takes.
    assert heap <= 32.0
    assert objects < 250  # one a run would be 1000
    assert blocks < 750  # some 400 however many runs there are
    assert still_open == []


@pytest.mark.parametrize("kind", ["parts", "one FMU"])
def test_5000_runs_take_no_more_memory(kind: str, tmp_path: Path) -> None:
    heap, _, blocks, still_open = left_by(kind, tmp_path, 1000, 5000)

    assert heap <= 64.0
    assert blocks < 2500  # one a run would be 5000
    assert still_open == []
