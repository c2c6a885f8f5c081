"""What runs after runs leave behind in a process of their own, where no thread of another test holds memory.

`python tests/cosim/runs.py KIND FOLDER WARM RUNS` prints the growth of the C heap in KiB, of Python's objects and of its blocks, and
what is still open.
"""

import ctypes
import gc
import json
import sys
from pathlib import Path

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


def main(kind: str, folder: str, warm: str, runs: str) -> None:
    what = system_of(kind, Path(folder))
    run_often(what, int(warm))
    files, heap, objects, blocks = held(), heap_kib(), len(gc.get_objects()), sys.getallocatedblocks()

    run_often(what, int(runs))

    more = [heap_kib() - heap, len(gc.get_objects()) - objects, sys.getallocatedblocks() - blocks]
    print(json.dumps([*more, sorted(left_behind(files))]))


if __name__ == "__main__":
    main(*sys.argv[1:])
