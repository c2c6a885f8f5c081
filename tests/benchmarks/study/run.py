"""Speed of the study's draws beside conditioning every draw directly on all data; run by `make bench`, never as a test.

Both are measured in one run with one BLAS thread, in seconds of processor time. Direct: for each draw and number of corrections a
new joint posterior of bench data and corrections, and the prediction of all six muscles over the grid. Ours does the same numbers.

    python tests/benchmarks/study/run.py [--draws 4096] [--direct 6]
"""

import argparse
import sys
import time

import numpy as np
from threadpoolctl import threadpool_limits

from orchestrator.gp.observations import observe
from orchestrator.gp.posterior import condition
from orchestrator.study.conditioned import GRID, coefficients, given_bench, size_over_grid
from orchestrator.study.draws import SIZES, Problem, tasks
from orchestrator.study.muscles import MUSCLES, capabilities
from orchestrator.study.researcher import SETS
from orchestrator.study.study import CollectTask, ModelsTask
from orchestrator.study.variants import Setting

LEAST_RATIO, AIM_RATIO, MOST_SECONDS, MOST_DIFFERENCE_N = 10.0, 25.0, 120.0, 1e-8


def main() -> None:
    """Print a table; exit code 1 when a target is missed."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--draws", type=int, default=4096)
    parser.add_argument("--direct", type=int, default=6, help="draws that are also done directly")
    arguments = parser.parse_args()
    corrections = CollectTask(1, 140.0, 8).run()
    good = True
    print(f"{'':38s} {'direct, s':>10s} {'ours, s':>9s} {'ratio':>7s} {'differ, N':>10s}")
    with threadpool_limits(limits=1, user_api="blas"):
        for name, holds in SETS.items():
            initial = ModelsTask(1, holds, True).run()
            problem, _ = Setting(initial, initial, corrections).learnt
            good &= _compare(name, problem, arguments.draws, arguments.direct)
    sys.exit(0 if good else 1)


def _compare(name: str, problem: Problem, draws: int, few: int) -> bool:
    began = time.process_time()
    found = np.concatenate([task.run() for task in tasks(problem, SIZES, draws, seed=1)])
    given = given_bench(problem.initial, problem.corrections)
    whole = given.errors(problem.deviation, np.arange(len(problem.corrections)))
    ours = time.process_time() - began
    rng = np.random.default_rng([1, 5, 0])
    orders = [rng.permutation(len(problem.corrections)) for _ in range(few)]
    began = time.process_time()
    slow = np.array([[_directly(problem, order[:size]) for size in SIZES] for order in orders])
    all_of_them = np.array([_directly(problem, order) for order in orders])
    direct = (time.process_time() - began) * draws / few
    differ = max(np.abs(found[:few] - slow).max(), np.abs(all_of_them - whole).max())
    rows = sum(len(each.inputs) for each in problem.initial.observations)
    what = f"{draws} draws x 7, {name} set ({rows} points)"
    print(f"{what:38s} {direct:10.0f} {ours:9.1f} {direct / ours:7.1f} {differ:10.1e}   aim {AIM_RATIO:g}")
    return bool(direct / ours >= LEAST_RATIO and differ < MOST_DIFFERENCE_N and ours < MOST_SECONDS)


def _directly(problem: Problem, chosen: np.ndarray) -> np.ndarray:
    some = problem.corrections.rows(chosen)
    seen = observe("corrections", some.state, coefficients(some), some.force, problem.deviation[chosen])
    posterior = condition(problem.initial.latents, [*problem.initial.observations, seen])
    true = capabilities(GRID)
    return np.array([size_over_grid(posterior.mean(m, GRID) - true[:, k]) for k, m in enumerate(MUSCLES)])


if __name__ == "__main__":
    main()
