"""What a second bus costs a cycle: `python -m tests.benchmarks.hil.two_buses [--cycles N]`; about half a minute.

A cycle is a session's: three questions in one call, their five answers, one torque frame. It goes to a virtual robot over
socketcand, and in turn to two of them as one, where the force sensor is asked on the second one.
"""

import argparse
import time
from collections.abc import Mapping
from contextlib import ExitStack, closing
from typing import Any

import numpy as np

from hil.barrett.start_up import start_up
from hil.bus.gate import TORQUE_IDENTIFIERS, let_go
from hil.bus.wire import Wire, open_wire
from hil.codecs.frame import parse_frame
from hil.control.timing import real_time_priority
from hil.virtual.control import Remote
from hil.virtual.process import virtual_robot

QUESTIONS = [parse_frame(text) for text in ("404#30", "008#36", "00A#08")]
ANSWERS = frozenset({0x423, 0x443, 0x463, 0x50A, 0x546})
NO_TORQUE, BLOCK, PERIOD_S = let_go()[0], 100, 0.002


def main() -> None:
    """Print what a cycle takes on one bus and on two."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--cycles", type=int, default=3000, help="on each")
    cycles = parser.parse_args().cycles
    with ExitStack() as stack:
        one, other = stack.enter_context(virtual_robot()), stack.enter_context(virtual_robot())
        wires = {}
        for name, settings in (("one bus", one), ("two buses", {**one, "also": [{**other, "nodes": [8]}]})):
            wires[name] = stack.enter_context(closing(open_wire(settings, TORQUE_IDENTIFIERS)))
            if name == "two buses":
                _only_the_sensor(other)
            start_up(wires[name], "right", time.sleep, lambda: True)
        refused = stack.enter_context(real_time_priority())
        found: dict[str, list[tuple[float, float]]] = {name: [] for name in wires}
        for _ in range(cycles // BLOCK):
            for name, wire in wires.items():
                wire.drain()
                found[name] += [_cycle(wire) for _ in range(BLOCK)]
    for name, values in found.items():
        wall, work = np.array(values).T * 1e6
        p50, p99 = np.percentile(wall, [50, 99])
        print(f"{name}: {p50:.0f} / {p99:.0f} us (50 / 99 %), {np.mean(work):.0f} us of the processor")
    print("".join(f"WITHOUT {words}\n" for words in refused), end="")


def _only_the_sensor(settings: Mapping[str, Any]) -> None:
    with Remote(settings["port"]) as remote:
        for node in (1, 2, 3, 10):
            remote.tell(f"silence {node}")


def _cycle(wire: Wire) -> tuple[float, float]:
    """Wall and processor time (s)."""
    time.sleep(PERIOD_S)
    wire.drain()
    began, worked = time.perf_counter(), time.process_time()
    wire.send(*QUESTIONS)
    missing = set(ANSWERS)
    while missing and (timed := wire.receive(0.1)) is not None:
        missing.discard(timed.frame.identifier)
    wire.send_decided(NO_TORQUE)
    return time.perf_counter() - began, time.process_time() - worked


if __name__ == "__main__":
    main()
