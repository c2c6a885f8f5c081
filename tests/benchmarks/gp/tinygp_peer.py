"""tinygp on the same problem, in an environment of its own; prints its figures as JSON. Compiling for a size is not counted."""

import json
import os
import sys
import time

# One thread, as for all others; read when JAX is loaded.
os.environ["XLA_FLAGS"] = "--xla_cpu_multi_thread_eigen=false intra_op_parallelism_threads=1"
for _name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS"):
    os.environ[_name] = "1"

TIGHT = {"ftol": 1e-12, "gtol": 1e-6}


def main(sizes: list[int]) -> None:
    """Least CPU ms of value and gradient, median CPU s of a fit over the starts, worst value, for each size."""
    import jax
    import numpy as np
    from lapack_reference import HIGH, LOW, begins, problem
    from scipy.optimize import minimize
    from tinygp import GaussianProcess, kernels, transforms

    jax.config.update("jax_enable_x64", True)
    found: dict = {"name": "tinygp", "likelihood_ms": [], "fit_s": [], "value": []}
    for n in sizes:
        x, y = problem(n)
        d = x.shape[1]

        def negative(theta, x=x, y=y, d=d):
            kernel = jax.numpy.exp(theta[d]) * transforms.Linear(jax.numpy.exp(-theta[:d]), kernels.ExpSquared())
            process = GaussianProcess(kernel, x, diag=jax.numpy.exp(theta[d + 1]))
            return -process.log_probability(y)

        both = jax.jit(jax.value_and_grad(negative))

        def objective(theta, both=both):
            value, slope = both(theta)
            return float(value), np.asarray(slope)

        objective(begins(d)[0])
        found["likelihood_ms"].append(1e3 * min(_cpu(lambda o=objective, d=d: o(begins(d)[0])) for _ in range(7)))
        bounds = [(LOW, HIGH)] * (d + 1) + [(np.log(1e-6), HIGH)]
        seconds, values = [], []
        for begin in begins(d):
            ends: list = []

            def fit(begin=begin, objective=objective, bounds=bounds, ends=ends):
                ends.append(minimize(objective, begin, jac=True, method="L-BFGS-B", bounds=bounds, options=TIGHT).fun)

            seconds.append(min(_cpu(fit) for _ in range(2)))
            values.append(float(ends[0]))
        found["fit_s"].append(float(np.median(seconds)))
        found["value"].append(max(values))
    print(json.dumps(found))


def _cpu(work) -> float:
    began = time.process_time()
    work()
    return time.process_time() - began


if __name__ == "__main__":
    main([int(each) for each in sys.argv[1:]])
