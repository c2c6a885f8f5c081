"""Speed of comparing signals, and agreement with pyfunnel where it is installed; run by `make bench`, never as a test.

pyfunnel is looked for in this environment and in `build/peers` (`make bench-peers`). Times are the least CPU of rounds
in one process. Exit code 1 when a limit is missed or a verdict differs.
"""

import json
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np

from orchestrator.regress.comparison import Signal, Tolerance, Tube, compare_signals
from orchestrator.regress.comparison.distance import distances
from orchestrator.regress.comparison.prepare import Pair, prepare
from tests.benchmarks.regress.signals import HEIGHT, SHIFT_S, SmallCase, long_signal, small_case, uneven_stamps

HERE = Path(__file__).parent
PEERS = HERE.parents[2] / "build/peers/bin/python"
ROUNDS = 9
SMALL_CASES = 200
TOLERANCE = Tolerance(HEIGHT, 0.0, SHIFT_S)
INSIDE_MS, WORST_MS, FIFTY_S = 3.0, 30.0, 0.2


def main() -> None:
    """Print both tables."""
    kept = _speed()
    kept &= _agreement()
    if not kept:
        sys.exit(1)


def long_cases() -> dict[str, tuple[Signal, float]]:
    """Results by name, with the limit in CPU ms for comparing one."""
    uneven = uneven_stamps()
    return {
        "identical": (long_signal(), INSIDE_MS),
        "jumps 1 ms late, shift 2 ms": (long_signal(1e-3), INSIDE_MS),
        "jumps 4 ms late, shift 2 ms": (long_signal(4e-3), WORST_MS),
        "all samples outside": (long_signal(offset=1.0), WORST_MS),
        "uneven stamps": (long_signal(stamps=uneven), WORST_MS),
        "uneven stamps, all outside": (long_signal(offset=1.0, stamps=uneven), WORST_MS),
    }


def _speed() -> bool:
    reference = long_signal()
    kept = True
    print(f"{'comparing 100,001 points, CPU ms':40s} {'misfit':>8s} {'pyfunnel':>9s} {'ratio':>7s}   points outside")
    for name, (result, limit) in long_cases().items():
        taken = 1e3 * _least_cpu(lambda result=result: compare_signals(result, reference, TOLERANCE))
        outside = compare_signals(result, reference, TOLERANCE).points_outside
        other = _pyfunnel(SmallCase(name, reference, result, SHIFT_S, HEIGHT), rounds=2)
        theirs, ratio, points = ("", "", "pyfunnel is not installed")
        if other is not None:
            theirs, ratio = f"{1e3 * other['cpu_s']:.0f}", f"{1e3 * other['cpu_s'] / taken:.0f}x"
            points = f"pyfunnel {len(other['outside'])}"
            kept &= len(other["outside"]) == outside
        kept &= taken <= limit
        late = f"   ABOVE the limit {limit:g}" if taken > limit else ""
        print(f"{name:40s} {taken:8.2f} {theirs:>9s} {ratio:>7s}   misfit {outside}, {points}{late}")
    fifty = {f"y{k}": replace(long_signal(1e-3), name=f"y{k}") for k in range(50)}
    references = {name: reference for name in fifty}
    taken = _least_cpu(lambda: [Tube(TOLERANCE).judge(fifty[name], references[name]) for name in fifty])
    print(f"{'50 signals, jumps 1 ms late':40s} {1e3 * taken:8.0f}")
    return kept and taken <= FIFTY_S


def _agreement() -> bool:
    """Whether the same points are outside in small random cases."""
    if _pyfunnel(small_case(0), rounds=1) is None:
        print("pyfunnel is not installed: no agreement to report")
        return True
    points = outside = differing = 0
    for seed in range(SMALL_CASES):
        case = small_case(seed)
        other = _pyfunnel(case, rounds=1)
        mine = np.flatnonzero(outside_points(case))
        assert other is not None
        points += len(case.result.time)
        outside += len(mine)
        differing += len(set(mine.tolist()) ^ set(other["outside"]))
    print(f"\n{SMALL_CASES} small cases, {points} points: {outside} outside, {differing} judged otherwise by pyfunnel")
    return differing == 0


def outside_points(case: SmallCase) -> np.ndarray:
    """Which samples of a small case's result are outside its tube, the moments of its jumps not excused."""
    pair = prepare("tube", case.result, case.reference, Tolerance(case.height, 0.0, case.shift_s))
    assert isinstance(pair, Pair)
    return distances(replace(pair, excuses_sampling=False))[1]


def _least_cpu(work: Callable[[], object]) -> float:
    taken = []
    for _ in range(ROUNDS):
        began = time.process_time()
        work()
        taken.append(time.process_time() - began)
    return min(taken)


@cache
def _python_with_pyfunnel() -> str | None:
    for python in (sys.executable, str(PEERS)):
        if Path(python).exists():
            done = subprocess.run([python, "-c", "import pyfunnel"], capture_output=True, check=False)
            if done.returncode == 0:
                return python
    return None


def _pyfunnel(case: SmallCase, rounds: int) -> dict | None:
    """What pyfunnel finds, or None where it is not installed."""
    python = _python_with_pyfunnel()
    if python is None:
        return None
    with tempfile.TemporaryDirectory() as folder:
        for name, column in (
            ("xr", case.reference.time),
            ("yr", case.reference.values),
            ("xt", case.result.time),
            ("yt", case.result.values),
        ):
            (Path(folder) / name).write_bytes(column.tobytes())
        command = [python, HERE / "pyfunnel_child.py", folder, case.shift_s, case.height, rounds]
        done = subprocess.run([str(part) for part in command], capture_output=True, text=True, check=True)
    return json.loads(done.stdout.splitlines()[-1])


if __name__ == "__main__":
    main()
