"""The compiled decision beside the same source as Python: `python -m tests.benchmarks.hil.compiled [--cycles N] [--seed S] [--recording DIR]`.

The adversary's random cycles go through both, each in a process of its own, and whatever comes out is compared by its digest, a block of
cycles at a time: torques to the last bit, reactions, words, the state that is kept. Prints how long a step of the core takes
in each, and with a RECORDING how long a decision of it takes, with the questions before it, and how fast all of it is replayed; all in CPU
time. Exit code 1 if any block differs.
"""

import argparse
import hashlib
import os
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from hil.compiled import PURE, build, is_used

BLOCK = 50_000
# The state is looked at this often; what it does wrong shows in later outcomes, too.
STATE_EVERY = 25
# Of each measurement; the least counts.
RUNS = 3


def digests(seed: int, cycles: int) -> Iterator[tuple[str, float]]:
    """The digest of each block of cycles, and the us that a step of the core took on average."""
    from hil.safety.core import step
    from tests.hil import adversary

    digest, spent, count = hashlib.sha256(), 0.0, 0

    def told(*given: Any, **more: Any) -> Any:
        nonlocal spent, count
        began = time.thread_time()
        state, outcome = step(*given, **more)
        spent += time.thread_time() - began
        count += 1
        digest.update(repr(outcome).encode())
        if count % STATE_EVERY == 0:
            digest.update(repr(state).encode())
        return state, outcome

    adversary.step = told  # type: ignore[assignment]
    adversary.breaches = lambda *given: []  # looked at by `adversarial`
    for block in range(-(-cycles // BLOCK)):
        digest, spent, count = hashlib.sha256(), 0.0, 0
        adversary.attack(seed + block, min(BLOCK, cycles - block * BLOCK))
        yield digest.hexdigest(), 1e6 * spent / count


def decisions(folder: Path) -> tuple[float, float]:
    """us of CPU time of a cycle's questions and decision, and of a cycle of the replay; the least of some runs, with the
    real-time priority that a session has."""
    from hil.control.timing import real_time_priority
    from hil.recording.replay import cycles_of
    from hil.session.recorded import recorded_pilot, replay_session

    given = [cycle.given for cycle in cycles_of(folder)]
    decided, replayed = [], []
    for _ in range(RUNS):
        pilot = recorded_pilot(folder)
        with real_time_priority():
            began = time.thread_time()
            for each in given:
                pilot.requests()
                pilot.decide(each)
            decided.append(time.thread_time() - began)
            began = time.thread_time()
            replay_session(folder)
            replayed.append(time.thread_time() - began)
    return 1e6 * min(decided) / len(given), 1e6 * min(replayed) / len(given)


def main() -> None:
    """Run both and compare."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--cycles", type=int, default=200_000)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--recording", type=Path)
    parser.add_argument("--alone", action="store_true", help=argparse.SUPPRESS)
    args = parser.parse_args()
    if args.alone:
        print(is_used_now(), flush=True)
        if args.recording is not None:
            print(*decisions(args.recording), flush=True)
            return
        for found, us in digests(args.seed, args.cycles):
            print(found, us, flush=True)
        return
    build()
    if args.recording is not None:
        _speeds(args.recording)
        return
    sides = [_side(args.cycles, args.seed, pure) for pure in ("", "1")]
    if [side.stdout.readline().strip() for side in sides if side.stdout] != ["True", "False"]:
        sys.exit("the two sides are not one compiled and one as Python")
    different, times, blocks = 0, [0.0, 0.0], 0
    while True:
        lines = [side.stdout.readline().split() for side in sides if side.stdout]
        if not all(lines):
            break
        different += lines[0][0] != lines[1][0]
        times = [spent + float(line[1]) for spent, line in zip(times, lines, strict=True)]
        blocks += 1
    codes = [side.wait() for side in sides]
    compiled, pure = (spent / max(blocks, 1) for spent in times)
    print(f"{args.cycles} cycles in {blocks} blocks: {different} differ")
    print(f"a step of the core: {compiled:.1f} us compiled, {pure:.1f} us as Python")
    sys.exit(1 if different or any(codes) or blocks != -(-args.cycles // BLOCK) else 0)


def _speeds(folder: Path) -> None:
    """One side after the other: beside each other they would slow each other down."""
    for pure, name in (("1", "as Python"), ("", "compiled")):
        side = _side(0, 0, pure, "--recording", str(folder))
        said, _ = side.communicate()
        decided, replayed = map(float, said.splitlines()[1].split())
        at_1000_hz = f"{1000.0 / replayed:.1f} times real time at 1000 Hz"
        print(
            f"{name}: a decision with its questions {decided:.1f} us, a cycle of the replay {replayed:.1f} us ({at_1000_hz})"
        )


def is_used_now() -> bool:
    """Whether the core of this process is the compiled one."""
    import hil.safety.core  # noqa: F401

    return is_used()


def _side(cycles: int, seed: int, pure: str, *more: str) -> "subprocess.Popen[str]":
    words = ["-m", "tests.benchmarks.hil.compiled", "--alone", "--cycles", str(cycles), "--seed", str(seed), *more]
    return subprocess.Popen([sys.executable, *words], env={**os.environ, PURE: pure}, stdout=subprocess.PIPE, text=True)


if __name__ == "__main__":
    main()
