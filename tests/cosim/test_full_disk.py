"""Results that cannot be written: one true line, and what was written before stays readable."""

import os
import shlex
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from faulty import faulty_fmu

from orchestrator.results import read_result

MISFIT = str(Path(sys.executable).with_name("misfit"))


def misfit(folder: Path, *arguments: object, blocks: int | None = None) -> "subprocess.CompletedProcess[str]":
    """The command, with files of at most so many KiB: the system refuses more as it does on a full disk."""
    limit = "" if blocks is None else f"ulimit -f {blocks}; "
    command = limit + "exec " + shlex.join([MISFIT, *map(str, arguments)])
    return subprocess.run(["bash", "-c", command], cwd=folder, capture_output=True, text=True, check=False)


@pytest.mark.parametrize("isolate", ["--isolate", "--no-isolate"])
@pytest.mark.parametrize("place", ["file/x.parquet", "/proc/x.csv", "folder"])
def test_a_place_that_cannot_be_written_is_one_line(tmp_path: Path, place: str, isolate: str) -> None:
    (tmp_path / "file").write_text("")
    (tmp_path / "folder").mkdir()
    fmu = faulty_fmu(tmp_path, "none")

    done = misfit(tmp_path, "run", fmu, isolate, "--stop", 1, "--step", 0.1, "--out", place)

    assert done.returncode == 2 and len(done.stderr.splitlines()) == 1, done.stderr
    assert place in done.stderr and "rows until then" not in done.stderr


@pytest.mark.parametrize("name", ["pipe.csv", "pipe.parquet", "pipe"])
def test_a_device_or_pipe_is_never_replaced_by_results(tmp_path: Path, name: str) -> None:
    os.mkfifo(tmp_path / name)

    done = misfit(tmp_path, "run", faulty_fmu(tmp_path, "none"), "--stop", 1, "--step", 0.1, "--out", name)

    assert (done.returncode, done.stderr) == (
        2,
        f"misfit: {name} is a device or a pipe; expected the name of a file of results\n",
    )
    assert (tmp_path / name).is_fifo() and not list(tmp_path.glob("pipe*.*unfinished"))


@pytest.mark.parametrize("command", [("sweep", "--set", "u=1,2"), ("build", "pendulum")])
def test_a_folder_that_cannot_be_made_is_one_line_before_any_work(tmp_path: Path, command: tuple[str, ...]) -> None:
    (tmp_path / "file").write_text("")
    arguments = [str(faulty_fmu(tmp_path, "none"))] if command[0] == "sweep" else []

    done = misfit(tmp_path, command[0], *arguments, *command[1:], "--out", "file/results")

    assert done.returncode == 2 and len(done.stderr.splitlines()) == 1, done.stderr
    assert "file/results cannot be written" in done.stderr


@pytest.mark.parametrize(
    ("ending", "blocks"), [("csv", 100), ("csv", 200), ("parquet", 100), ("parquet", 30), ("h5", 100)]
)
def test_a_full_disk_keeps_what_it_took_and_the_message_says_where(tmp_path: Path, ending: str, blocks: int) -> None:
    """10001 rows are 160 kB in the side file and 290 kB as CSV: the disk is full while rows come, in the first
    block of 2048 of them already, or only at the end."""
    fmu = faulty_fmu(tmp_path, "none")

    done = misfit(
        tmp_path, "run", fmu, "--no-isolate", "--stop", 1, "--step", 1e-4, "--out", f"x.{ending}", blocks=blocks
    )

    assert done.returncode == 2 and len(done.stderr.splitlines()) == 1, done.stderr
    assert f"rows until then are in x.{ending}.unfinished" in done.stderr
    assert not (tmp_path / f"x.{ending}").exists()
    count = int(done.stderr.split(" rows until then")[0].split()[-1])
    result = read_result(tmp_path / f"x.{ending}")
    assert len(result.time) == count > 0.9 * min(blocks * 1024 - 2000, 160_000) / 16
    assert np.allclose(result.time, np.arange(count) * 1e-4)
