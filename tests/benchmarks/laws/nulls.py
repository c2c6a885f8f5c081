"""Proposals where nothing is to be found: `python -m tests.benchmarks.laws.nulls [--records 100] [--first 1000]`.

Records of the mass with nothing missing, every other one pushed by a white force of 0.3 N that nothing can predict. Exit code 1 if a formula
is proposed for one of them.
"""

import argparse
import sys
import tempfile
from pathlib import Path

import numpy as np

from orchestrator.discover import discover
from orchestrator.measurements import load_measurements
from tests.laws.oscillator import recorded

# N, and the time for which each push lasts.
PUSH, HELD_S, PUSHES = 0.3, 0.015, 400


def proposals(seed: int) -> list[str]:
    """Formulas that are proposed for a record."""
    pushes = (0.0 if seed % 2 else PUSH) * np.random.default_rng(seed).standard_normal(PUSHES)
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        model = recorded(folder, lambda t, x, v: float(pushes[min(int(t / HELD_S), PUSHES - 1)]), seed=seed, n=300)
        found = discover(model, load_measurements(name), folder / "out", workers=1, laws=True)
    return [law.formula for law in found.laws]


def main() -> None:
    """Print what is proposed, and of how many records."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--records", type=int, default=100)
    parser.add_argument("--first", type=int, default=1000, help="first seed")
    args = parser.parse_args()
    wrong = 0
    for done, seed in enumerate(range(args.first, args.first + args.records), start=1):
        if found := proposals(seed):
            wrong += 1
            print(f"record {seed}: {found}", flush=True)
        if done % 10 == 0:
            print(f"{done} records, {wrong} with a proposal", flush=True)
    sys.exit(1 if wrong else 0)


if __name__ == "__main__":
    main()
