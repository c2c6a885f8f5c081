"""Covariance functions: what a latent function can look like before any datum is seen."""

from orchestrator.gp.kernels.base import Kernel, Product, Sum
from orchestrator.gp.kernels.composed import OnInputs
from orchestrator.gp.kernels.radial import Matern32, Matern52, SquaredExponential
from orchestrator.gp.kernels.simple import Constant, Linear, Periodic

__all__ = [
    "Constant",
    "Kernel",
    "Linear",
    "Matern32",
    "Matern52",
    "OnInputs",
    "Periodic",
    "Product",
    "SquaredExponential",
    "Sum",
]
