"""GPyTorch on the same problem, in an environment of its own: exact, by Cholesky factors, in double precision on one thread."""

import sys
from typing import Any

from peer_timing import Objective, Predict, report


def process_of(x: Any, y: Any) -> Any:
    """Its process and likelihood; parameters are logarithms by its own constraints."""
    import gpytorch
    import torch
    from gpytorch.constraints import Positive

    torch.set_num_threads(1)
    torch.set_default_dtype(torch.float64)

    def logarithm() -> Any:
        return Positive(transform=torch.exp, inv_transform=torch.log)

    class Process(gpytorch.models.ExactGP):  # type: ignore[misc]
        def __init__(self, likelihood: Any) -> None:
            super().__init__(torch.tensor(x), torch.tensor(y), likelihood)
            radial = gpytorch.kernels.RBFKernel(ard_num_dims=x.shape[1], lengthscale_constraint=logarithm())
            self.kernel = gpytorch.kernels.ScaleKernel(radial, outputscale_constraint=logarithm())

        def forward(self, inputs: Any) -> Any:
            return gpytorch.distributions.MultivariateNormal(torch.zeros(len(inputs)), self.kernel(inputs))

    likelihood = gpytorch.likelihoods.GaussianLikelihood(noise_constraint=logarithm())
    return Process(likelihood), likelihood


def objective_of(x: Any, y: Any) -> Objective:
    """Its marginal likelihood."""
    import gpytorch
    import torch

    process, likelihood = process_of(x, y)
    process.train()
    marginal = gpytorch.mlls.ExactMarginalLogLikelihood(likelihood, process)
    scales, variance = process.kernel.base_kernel.raw_lengthscale, process.kernel.raw_outputscale
    noise, d = likelihood.raw_noise, x.shape[1]

    def objective(theta: Any) -> tuple[float, Any]:
        with torch.no_grad():
            scales[0], noise[0] = torch.tensor(theta[:d]), theta[d + 1]
            variance.fill_(theta[d])
        with gpytorch.settings.fast_computations(False, False, False):
            value = -len(y) * marginal(process(*process.train_inputs), process.train_targets)
            slopes = torch.autograd.grad(value, (scales, variance, noise))
        return float(value), torch.cat([each.reshape(-1) for each in slopes]).numpy()

    return objective


def predict_of(x: Any, y: Any, theta: Any, points: Any) -> Predict:
    """Mean and deviation, with its caches of the mean and of the factor warm."""
    import gpytorch
    import torch

    process, likelihood = process_of(x, y)
    d, at = x.shape[1], torch.tensor(points)
    with torch.no_grad():
        process.kernel.base_kernel.raw_lengthscale[0] = torch.tensor(theta[:d])
        process.kernel.raw_outputscale.fill_(theta[d])
        likelihood.raw_noise[0] = theta[d + 1]
    process.eval()

    def predict() -> tuple[Any, Any]:
        with torch.no_grad(), gpytorch.settings.fast_computations(False, False, False):
            found = process(at)
            return found.mean.numpy(), found.variance.sqrt().numpy()

    predict()
    return predict


if __name__ == "__main__":
    report("GPyTorch", objective_of, predict_of, [int(each) for each in sys.argv[1:]])
