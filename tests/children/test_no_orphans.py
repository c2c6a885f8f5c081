"""No process outlives the command that began it, however that ends."""

import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

import pytest
from commands import COMMANDS, OTHERS, OTHERS_WITH_MODELS, arguments_of, fmu_that, start

from fmus.children import BrokenWorker, Workers, run_tool
from fmus.children.start import ToolTimeout

PATIENCE_S = 60.0
# A compiler in an endless loop, with a child of its own.
BUSY = "import os, time\nprint(os.getpid(), flush=True)\nos.fork()\ntime.sleep(600)"


@pytest.mark.parametrize("command", [*COMMANDS, *OTHERS_WITH_MODELS, *OTHERS])
def test_a_command_that_is_killed_leaves_nothing_behind(command: str, tmp_path: Path) -> None:
    working = tmp_path / "working"
    working.mkdir()
    arguments = arguments_of(command, working, fmu_that("hang", tmp_path / "models"))
    more = {"hil hold": ["--seconds", "600"], "study caregivers": ["--draws", "100000"], "studio": ["endless"]}.get(
        command, []
    )
    with start([*arguments, *more], working) as process:
        wanted = {"sweep": 4, "hil hold": 4, "study caregivers": 2}.get(command, 1)
        wait_for(lambda: len(descendants(process.pid)) >= wanted or process.poll() is not None)
        assert process.poll() is None, process.communicate(timeout=60)
        children = descendants(process.pid)

        process.send_signal(signal.SIGKILL)
        process.wait(timeout=60)

        wait_for(lambda: not any(map(is_running, children)))


def test_a_worker_that_is_killed_costs_its_call_and_no_other() -> None:
    with Workers(1) as pool:
        with pytest.raises(BrokenWorker, match="exit code -9"):
            pool.submit(signal.raise_signal, signal.SIGKILL).result()
        assert pool.submit(divmod, 7, 2).result() == (3, 1)
        with pytest.raises(ZeroDivisionError):
            pool.submit(divmod, 7, 0).result()


def test_workers_end_in_the_middle_of_their_work_when_the_pool_is_closed() -> None:
    before = descendants(os.getpid())
    with Workers(2) as pool:
        running = [pool.submit(time.sleep, 600) for _ in range(2)]
        wait_for(lambda: len(descendants(os.getpid()) - before) == 2)
    assert descendants(os.getpid()) <= before
    assert all(isinstance(each.exception(), BrokenWorker) for each in running)


def test_a_program_that_takes_too_long_is_killed_with_what_it_started() -> None:
    before = descendants(os.getpid())
    with pytest.raises(ToolTimeout, match="more than 0.3 s"):
        run_tool([sys.executable, "-c", BUSY], timeout_s=0.3)
    # What another test of this process left behind may end meanwhile.
    wait_for(lambda: descendants(os.getpid()) <= before)


def test_a_program_gets_no_more_memory_than_it_may_have() -> None:
    done = run_tool([sys.executable, "-c", "x = bytes(2 << 30)"], memory_gib=1.0)
    assert done.returncode == 1 and "MemoryError" in done.stderr


def descendants(process: int) -> set[int]:
    """Numbers of all processes below one that run."""
    found: set[int] = set()
    table = subprocess.run(["ps", "-eo", "pid=,ppid=,stat="], capture_output=True, text=True, check=True).stdout
    rows = [line.split() for line in table.splitlines()]
    waiting = [process]
    while waiting:
        above = waiting.pop()
        below = [int(pid) for pid, parent, state in rows if int(parent) == above and state[0] != "Z"]
        waiting += below
        found.update(below)
    return {each for each in found if not _is_ps(each)}


def _is_ps(process: int) -> bool:
    try:
        return Path(f"/proc/{process}/comm").read_text().strip() == "ps"
    except OSError:
        return True


def is_running(process: int) -> bool:
    """Whether a process is there and not only waits to be collected."""
    try:
        return Path(f"/proc/{process}/stat").read_text().rpartition(")")[2].split()[0] != "Z"
    except OSError:
        return False


def wait_for(condition: Callable[[], bool]) -> None:
    """Wait until something has happened."""
    deadline = time.monotonic() + PATIENCE_S
    while not condition():
        assert time.monotonic() < deadline, f"it did not happen within {PATIENCE_S:.0f} s"
        time.sleep(0.02)
