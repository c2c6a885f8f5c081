"""Runs after runs in one process leave nothing behind: no memory, no objects, no open files, no child processes."""

import ctypes
import gc
import sys
from pathlib import Path

import pytest
from faulty import held, left_behind
from systems import pair

from orchestrator.cosim import Simulation, System
from orchestrator.cosim.container import container_of
from orchestrator.cosim.load import load_system


class _Heap(ctypes.Structure):
    """`struct mallinfo2` of the GNU C library."""

    _fields_ = [
        (name, ctypes.c_size_t)
        for name in ("arena", "ordblks", "smblks", "hblks", "hblkhd", "usmblks", "fsmblks", "used", "free", "keepcost")
    ]


def heap_kib() -> float:
    """What is in use of the C heap, in KiB."""
    function = ctypes.CDLL(None).mallinfo2
    function.restype = _Heap
    return float(function().used) / 1024


def system_of(kind: str, folder: Path) -> System:
    return pair() if kind == "parts" else load_system(container_of(pair(), "pair", folder)[0][0])


def run_often(what: System, runs: int) -> None:
    for _ in range(runs):
        with Simulation(what, step=1e-3, stop=0.01) as run:
            run.run(0.01)
    gc.collect()


@pytest.mark.parametrize("kind", ["parts", "one FMU"])
def test_500_runs_leave_nothing_behind(kind: str, tmp_path: Path) -> None:
    what = system_of(kind, tmp_path)
    run_often(what, 100)
    files, heap, objects = held(), heap_kib(), len(gc.get_objects())

    run_often(what, 500)

    # 64 bytes a run: less than any instance, state or table takes.
    assert heap_kib() - heap <= 32.0
    assert len(gc.get_objects()) - objects < 250  # one a run would be 500
    assert not left_behind(files)


@pytest.mark.parametrize("kind", ["parts", "one FMU"])
def test_5000_runs_take_no_more_memory(kind: str, tmp_path: Path) -> None:
    what = system_of(kind, tmp_path)
    run_often(what, 1000)
    heap, blocks = heap_kib(), sys.getallocatedblocks()

    run_often(what, 5000)

    assert heap_kib() - heap <= 64.0
    assert sys.getallocatedblocks() - blocks < 2500  # one a run would be 5000
