"""How a library in an environment of its own is timed: it gives its likelihood as a function of logarithms, this fits and measures."""

import json
import os
import time
from collections.abc import Callable
from typing import Any

# One thread, as for all others; read when numerical libraries are loaded.
os.environ["XLA_FLAGS"] = "--xla_cpu_multi_thread_eigen=false intra_op_parallelism_threads=1"
for _name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ[_name] = "1"

TIGHT = {"ftol": 1e-12, "gtol": 1e-6}
ROUNDS = 7

# Negative log likelihood and its gradient for logarithms of length scales, variance and noise variance.
Objective = Callable[[Any], tuple[float, Any]]
# Mean and standard deviation (without noise) at points, for the first start's hyperparameters.
Predict = Callable[[], tuple[Any, Any]]
POINTS = 1000


def points_of(x: Any) -> Any:
    """Where all libraries predict, (POINTS, d): within the range of the data."""
    import numpy as np

    return np.random.default_rng(5).uniform(x.min(axis=0), x.max(axis=0), (POINTS, x.shape[1]))


def report(
    name: str,
    objective_of: Callable[[Any, Any], Objective],
    predict_of: Callable[[Any, Any, Any, Any], Predict],
    sizes: list[int],
) -> None:
    """Print as JSON: least CPU ms of value and gradient and of a prediction, median CPU s of a fit over the starts, worst value, for each size."""
    import numpy as np
    from lapack_reference import begins, problem

    found: dict[str, Any] = {
        "name": name,
        "likelihood_ms": [],
        "predict_ms": [],
        "fit_s": [],
        "value": [],
        "predicted": [],
    }
    for n in sizes:
        x, y = problem(n)
        objective, starts = objective_of(x, y), begins(x.shape[1])
        objective(starts[0])  # what is compiled for a size is not counted
        found["likelihood_ms"].append(1e3 * min(_cpu(objective, starts[0])[0] for _ in range(ROUNDS)))
        predict = predict_of(x, y, starts[0], points_of(x))
        found["predicted"].append([[float(each) for each in part[:5]] for part in predict()])
        found["predict_ms"].append(1e3 * min(_cpu(predict)[0] for _ in range(ROUNDS)))
        fits = [min(_cpu(_fit, objective, start) for _ in range(2)) for start in starts]
        found["fit_s"].append(float(np.median([seconds for seconds, _ in fits])))
        found["value"].append(max(value for _, value in fits))
    print(json.dumps(found))


def _fit(objective: Objective, start: Any) -> float:
    import numpy as np
    from lapack_reference import HIGH, LOW
    from scipy.optimize import minimize

    bounds = [(LOW, HIGH)] * (len(start) - 1) + [(np.log(1e-6), HIGH)]
    return float(minimize(objective, start, jac=True, method="L-BFGS-B", bounds=bounds, options=TIGHT).fun)


def _cpu(work: Callable[..., Any], *arguments: Any) -> tuple[float, Any]:
    """CPU seconds of a call, and what it returned."""
    began = time.process_time()
    result = work(*arguments)
    return time.process_time() - began, result
