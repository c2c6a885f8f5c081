"""What the likelihood would cost as a CasADi function: built, and value and gradient in CPU ms, beside the one on LAPACK.

python tests/benchmarks/gp/casadi_likelihood.py [--sizes 40 84]
"""

import argparse
import time
from collections.abc import Callable
from functools import partial

import casadi
import numpy as np
from lapack_reference import begins, problem
from peers import misfit_likelihood
from threadpoolctl import threadpool_limits

ROUNDS = 20


def as_casadi(x: np.ndarray, y: np.ndarray) -> casadi.Function:
    """Value and gradient of the negative log marginal likelihood, of logarithms of length scales, variance and noise variance."""
    n, d = x.shape
    theta = casadi.SX.sym("theta", d + 2)
    squares = sum(np.subtract.outer(x[:, k], x[:, k]) ** 2 * casadi.exp(-2.0 * theta[k]) for k in range(d))
    matrix = casadi.exp(theta[d]) * casadi.exp(-0.5 * squares) + casadi.exp(theta[d + 1]) * casadi.SX.eye(n)
    upper = casadi.chol(matrix)
    half = casadi.solve(upper.T, y)
    value = 0.5 * casadi.sumsqr(half) + casadi.sum1(casadi.log(casadi.diag(upper))) + 0.5 * n * np.log(2.0 * np.pi)
    return casadi.Function("likelihood", [theta], [value, casadi.gradient(value, theta)])


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--sizes", nargs="+", type=int, default=[40, 84])
    print(f"{'n':>5s}{'build, s':>12s}{'CasADi, ms':>12s}{'LAPACK, ms':>12s}{'apart':>10s}")
    with threadpool_limits(1, "blas"):
        for n in parser.parse_args().sizes:
            x, y = problem(n)
            began, ours, start = time.process_time(), misfit_likelihood(x, y), begins(x.shape[1])[0]
            function = as_casadi(x, y)
            built = time.process_time() - began
            apart = abs(float(function(start)[0]) - float(ours()[0]))
            times = [_least(work) for work in (partial(function, start), ours)]
            print(f"{n:5d}{built:12.2f}{times[0]:12.3f}{times[1]:12.3f}{apart:10.1e}", flush=True)


def _least(work: Callable[[], object]) -> float:
    least = np.inf
    for _ in range(ROUNDS):
        began = time.process_time()
        work()
        least = min(least, time.process_time() - began)
    return 1e3 * least


if __name__ == "__main__":
    main()
