"""Ten million adversarial cycles of the safety core: `python -m tests.benchmarks.hil.adversarial [--cycles N] [--seed S]`."""

import argparse
import sys
import time

from tests.hil.adversary import attack

# Cycles of one seed; any of them can be run alone.
_PART = 100_000


def main() -> None:
    """Print how many cycles breached a limit."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--cycles", type=int, default=10_000_000)
    parser.add_argument("--seed", type=int, default=1)
    args = parser.parse_args()
    began, cycles, energised, stopped, breached = time.process_time(), 0, 0, 0, 0
    for seed in range(args.seed, args.seed + -(-args.cycles // _PART)):
        found = attack(seed, min(_PART, args.cycles - cycles))
        cycles += found.cycles
        energised += found.energised
        stopped += found.stopped
        breached += len(found.breaches)
        for words in found.breaches[:5]:
            print(f"BREACH with seed {seed}: {words}", flush=True)
    used = time.process_time() - began
    print(
        f"{cycles} cycles in {used:.0f} CPU s ({1e6 * used / cycles:.0f} us each): torque was on in {energised},"
        f" the arm was stopped in {stopped}, limits breached {breached} times"
    )
    sys.exit(1 if breached else 0)


if __name__ == "__main__":
    main()
