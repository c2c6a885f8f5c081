"""Cost of the Gaussian-process block beside a likelihood written by hand on LAPACK and other libraries; run by `make bench`, never as a test.

Figures are CPU times, the least of rounds in turn in one process with one BLAS thread. Libraries that are not installed are said
to be missing. Exit code 1 when a limit is missed or an optimum is worse than another's.

    python tests/benchmarks/gp/run.py [--peers PYTHON ...]
"""

import argparse
import json
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
from lapack_reference import STARTS, begins, problem
from online_cost import exchange, predictions
from peer_timing import POINTS, points_of
from peers import PEERS, misfit_fit, misfit_likelihood, misfit_mixed, misfit_predict, sklearn_predict
from threadpoolctl import threadpool_limits

SIZES = (84, 336, 756)
ROUNDS = 7
ROOT = Path(__file__).parents[3]
# Libraries that need environments of their own: their scripts.
ALONE = {"tinygp": "tinygp_peer.py", "GPyTorch": "gpytorch_peer.py"}
OTHERS: list[dict] = []
WORSE = 1e-6
# A likelihood may cost this share of one written by hand for one kernel, a fit this share of the fastest other.
LIMITS_MIXED = {2: 1.3, 3: 1.5, 7: 2.8}
LIMITS_LIKELIHOOD, LIMITS_FIT = (2.0, 1.2, 1.2), (1.2, 1.0, 1.0)
# A prediction may cost this share of the fastest other.
LIMITS_PREDICT = (1.2, 1.2, 1.2)
SAME = 1e-9


def main() -> None:
    """Print the tables."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--peers", metavar="PYTHON", nargs="+", default=[str(ROOT / "build/peers/bin/python")])
    pythons = parser.parse_args().peers
    OTHERS.extend(found for name, script in ALONE.items() if (found := _alone(name, script, pythons)))
    with threadpool_limits(1, "blas"):
        kept = all([_likelihoods(), _mixed(), _fits(), _predictions_at_many(), exchange(), predictions()])
    sys.exit(0 if kept else 1)


def _alone(name: str, script: str, pythons: list[str]) -> dict:
    """Figures of a library by the first of the interpreters that has it; nothing, and a word, where none has."""
    for python in filter(Path.exists, map(Path, pythons)):
        there = subprocess.run([python, "-c", f"import {name.lower()}"], capture_output=True, check=False)
        if there.returncode == 0:
            break
    else:
        print(f"{name}: not installed (make bench-peers)")
        return {}
    command = [python, Path(__file__).with_name(script), *map(str, SIZES)]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    if done.returncode != 0:
        print(f"{name}: {(done.stderr.strip().splitlines() or ['failed'])[-1][:80]}")
        return {}
    return json.loads(done.stdout)


def _least(work: dict[str, Callable[[], object]]) -> dict[str, float]:
    """CPU ms of each, the least over rounds; short work is repeated within a round."""
    found = dict.fromkeys(work, np.inf)
    for _ in range(ROUNDS):
        for name, each in work.items():
            began, count = time.process_time(), 0
            while count == 0 or time.process_time() - began < 0.02:
                each()
                count += 1
            found[name] = min(found[name], 1e3 * (time.process_time() - began) / count)
    return found


def _likelihoods() -> bool:
    print(f"{'likelihood and gradient, CPU ms':38s}" + "".join(f"{f'n = {n}':>12s}" for n in SIZES))
    table: dict[str, list[float]] = {}
    for n in SIZES:
        x, y = problem(n)
        work = {"misfit": misfit_likelihood(x, y)}
        for name, (likelihood, _) in PEERS.items():
            try:
                work[name] = likelihood(x, y)
            except ImportError:
                print(f"{name}: not installed")
        for name, figure in _least(work).items():
            table.setdefault(name, []).append(figure)
    table |= {other["name"]: other["likelihood_ms"] for other in OTHERS}
    for name, row in table.items():
        print(f"{name:38s}" + "".join(f"{each:12.3f}" for each in row))
    ratios = [one / other for one, other in zip(table["misfit"], table["LAPACK by hand"], strict=True)]
    return _judge("misfit / by hand", ratios, LIMITS_LIKELIHOOD)


def _mixed() -> bool:
    """Likelihoods of sums of functions with known factors, as a ratio to that of one function."""
    x, y = problem(SIZES[-1])
    figures = _least({str(count): misfit_mixed(x, y, count) for count in (1, *LIMITS_MIXED)})
    print(
        f"\n{f'sums of functions, n = {SIZES[-1]}, CPU ms':38s}" + "".join(f"{each:12.3f}" for each in figures.values())
    )
    ratios = [figures[str(count)] / figures["1"] for count in LIMITS_MIXED]
    return _judge(f"{', '.join(map(str, LIMITS_MIXED))} functions / one", ratios, tuple(LIMITS_MIXED.values()))


def _fits() -> bool:
    print(f"\n{f'one fit, CPU s (median of {STARTS} starts)':38s}" + "".join(f"{f'n = {n}':>12s}" for n in SIZES))
    fits = {"misfit": misfit_fit} | {name: each for name, (_, each) in PEERS.items()}
    table: dict[str, list[float]] = {}
    values: dict[str, list[float]] = {}
    for n in SIZES:
        x, y = problem(n)
        for name, each in fits.items():
            try:
                seconds, optima = _starts(each, x, y)
            except ImportError:
                continue
            table.setdefault(name, []).append(seconds)
            values.setdefault(name, []).append(optima)
    for other in OTHERS:
        table[other["name"]], values[other["name"]] = other["fit_s"], other["value"]
    for name, row in table.items():
        print(f"{name:38s}" + "".join(f"{each:12.4f}" for each in row))
    fastest = [min(row[k] for name, row in table.items() if name != "misfit") for k in range(len(SIZES))]
    kept = _judge("misfit / fastest other", [a / b for a, b in zip(table["misfit"], fastest, strict=True)], LIMITS_FIT)
    print(f"\n{'worst optimum of the starts':38s}")
    for name, row in values.items():
        print(f"{name:38s}" + "".join(f"{each:18.8f}" for each in row))
    best = [min(row[k] for row in values.values()) for k in range(len(SIZES))]
    return kept and all(value <= least + WORSE for value, least in zip(values["misfit"], best, strict=True))


def _predictions_at_many() -> bool:
    """Mean and deviation at many points, and whether all say the same."""
    print(f"\n{f'mean and deviation at {POINTS} points, CPU ms':38s}" + "".join(f"{f'n = {n}':>12s}" for n in SIZES))
    table: dict[str, list[float]] = {}
    same = True
    for k, n in enumerate(SIZES):
        x, y = problem(n)
        work = {"misfit": misfit_predict(x, y, points_of(x))}
        try:
            work["scikit-learn"] = sklearn_predict(x, y, points_of(x))
        except ImportError:
            print("scikit-learn: not installed")
        for name, figure in _least(work).items():
            table.setdefault(name, []).append(figure)
        ours, *here = ([part[:5] for part in each()] for each in work.values())
        others = [*(other["predicted"][k] for other in OTHERS), *here]
        same = same and all(np.allclose(ours, other, atol=SAME) for other in others)
    table |= {other["name"]: other["predict_ms"] for other in OTHERS}
    for name, row in table.items():
        print(f"{name:38s}" + "".join(f"{each:12.3f}" for each in row))
    print(f"all say the same: {same}")
    rivals = [row for name, row in table.items() if name != "misfit"]
    if not rivals:
        return same
    ratios = [own / min(row[k] for row in rivals) for k, own in enumerate(table["misfit"])]
    return _judge("misfit / fastest other", ratios, LIMITS_PREDICT) and same


def _starts(each: Callable, x: np.ndarray, y: np.ndarray) -> tuple[float, float]:
    """Median CPU seconds of a fit, each start's the least of two, and the worst value."""
    seconds, values = [], []
    for begin in begins(x.shape[1]):
        least = np.inf
        for _ in range(2):
            began = time.process_time()
            value, _ = each(x, y, begin)
            least = min(least, time.process_time() - began)
        seconds.append(least)
        values.append(value)
    return float(np.median(seconds)), max(values)


def _judge(name: str, ratios: list[float], limits: tuple[float, ...]) -> bool:
    late = any(ratio > limit for ratio, limit in zip(ratios, limits, strict=True))
    print(f"{name:38s}" + "".join(f"{ratio:12.2f}" for ratio in ratios) + (f"   ABOVE {limits}" if late else ""))
    return not late


if __name__ == "__main__":
    main()
