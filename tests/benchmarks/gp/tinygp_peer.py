"""tinygp on the same problem, in an environment of its own; compiling for a size is not counted."""

import sys
from typing import Any

from peer_timing import Objective, Predict, report


def objective_of(x: Any, y: Any) -> Objective:
    """Its likelihood, compiled with the gradient."""
    import jax
    import numpy as np
    from tinygp import GaussianProcess, kernels, transforms

    jax.config.update("jax_enable_x64", True)
    d = x.shape[1]

    def negative(theta: Any) -> Any:
        kernel = jax.numpy.exp(theta[d]) * transforms.Linear(jax.numpy.exp(-theta[:d]), kernels.ExpSquared())
        return -GaussianProcess(kernel, x, diag=jax.numpy.exp(theta[d + 1])).log_probability(y)

    both = jax.jit(jax.value_and_grad(negative))

    def objective(theta: Any) -> tuple[float, Any]:
        value, slope = both(theta)
        return float(value), np.asarray(slope)

    return objective


def predict_of(x: Any, y: Any, theta: Any, points: Any) -> Predict:
    """Mean and deviation from a factor that is there, compiled."""
    import jax
    import numpy as np
    from tinygp import GaussianProcess, kernels, transforms

    d = x.shape[1]
    kernel = np.exp(theta[d]) * transforms.Linear(np.exp(-theta[:d]), kernels.ExpSquared())
    process = GaussianProcess(kernel, x, diag=np.exp(theta[d + 1]))
    weights = process.solver.solve_triangular(process.solver.solve_triangular(y), transpose=True)

    @jax.jit
    def both(at: Any) -> Any:
        cross = kernel(x, at)
        explained = process.solver.solve_triangular(cross)
        return cross.T @ weights, jax.numpy.sqrt(np.exp(theta[d]) - (explained**2).sum(axis=0))

    return lambda: tuple(np.asarray(each) for each in both(points))  # type: ignore[return-value]


if __name__ == "__main__":
    report("tinygp", objective_of, predict_of, [int(each) for each in sys.argv[1:]])
