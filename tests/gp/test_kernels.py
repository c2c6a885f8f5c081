"""Kernels: algebra, symmetry, positive semidefiniteness and derivatives."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from fmus.errors import MisfitError
from orchestrator.gp.kernels import (
    Constant,
    Kernel,
    Linear,
    Matern32,
    Matern52,
    OnInputs,
    Periodic,
    SquaredExponential,
)
from orchestrator.gp.kernels.base import Pairs

SMOOTH = SquaredExponential(1.7, (0.8, 2.5))
KERNELS: dict[str, Kernel] = {
    "squared exponential": SMOOTH,
    "matern 3/2": Matern32(0.6, (1.3, 0.4)),
    "matern 5/2": Matern52(2.2, (0.9, 1.1)),
    "constant": Constant(3.0),
    "linear": Linear((0.5, 2.0)),
    "periodic": Periodic(1.2, (1.9, 3.1), (0.7, 1.4)),
    "sum": SMOOTH + Linear((0.5, 2.0)),
    "product": Matern52(1.1, (0.9, 1.1)) * Periodic(1.2, (1.9, 3.1), (0.7, 1.4)),
    "on one input": OnInputs((1,), Matern32(0.6, (0.4,))),
}
STEP = 1e-30
every = pytest.mark.parametrize("kernel", KERNELS.values(), ids=KERNELS)


def points(count: int, seed: int) -> np.ndarray:
    return np.random.default_rng(seed).normal(size=(count, 2))


@every
def test_a_kernel_is_symmetric_and_agrees_with_its_diagonal(kernel):
    x, y = points(7, 0), points(5, 1)
    assert np.allclose(kernel(x, y), kernel(y, x).T, rtol=1e-14, atol=0)
    assert np.allclose(np.diag(kernel(x, x)), kernel.diagonal(x), rtol=1e-14, atol=0)


@pytest.mark.parametrize("name", KERNELS)
@settings(deadline=None, max_examples=25)
@given(flat=st.lists(st.floats(-5, 5), min_size=2, max_size=16))
def test_no_combination_of_points_has_a_negative_variance(name, flat):
    x = np.array(flat[: len(flat) // 2 * 2]).reshape(-1, 2)
    k = KERNELS[name](x, x)
    assert np.linalg.eigvalsh(k).min() >= -1e-13 * max(np.trace(k), 1e-300)


@every
def test_input_gradients_agree_with_the_complex_step(kernel):
    x, y = points(4, 2), points(3, 3)
    found = kernel.input_gradient(x, y)
    for k in range(2):
        moved = x.astype(complex)
        moved[:, k] += 1j * STEP
        assert np.allclose(found[:, :, k], kernel(moved, y).imag / STEP, rtol=1e-13, atol=1e-15)


@every
def test_value_gradients_agree_with_the_complex_step(kernel):
    x, y = points(4, 4), points(3, 5)
    found = list(kernel.value_gradients(x, y))
    assert len(found) == len(kernel.values) == len(kernel.names)
    for k, gradient in enumerate(found):
        values = kernel.values.astype(complex)
        values[k] += 1j * STEP
        assert np.allclose(gradient, kernel.with_values(values)(x, y).imag / STEP, rtol=1e-13, atol=1e-15)


@every
def test_values_of_pairs_are_the_lower_triangle(kernel):
    x = points(6, 22)
    pairs = Pairs(x)
    values, _ = kernel.on_pairs(pairs)
    triangle = np.zeros((6, 6))
    triangle[pairs.row, pairs.column] = values
    assert np.allclose(triangle, np.tril(kernel(x, x)), rtol=1e-13, atol=1e-15)


@every
def test_slopes_of_pairs_are_the_weighted_sum_of_value_gradients(kernel):
    x, weights = points(5, 20), np.random.default_rng(21).normal(size=15)
    pairs = Pairs(x)
    expected = [weights @ gradient[pairs.row, pairs.column] for gradient in kernel.value_gradients(x, x)]
    assert np.allclose(kernel.on_pairs(pairs)[1](weights), expected, rtol=1e-12, atol=1e-13)


@every
def test_a_prepared_kernel_is_the_kernel_at_one_point(kernel):
    x, y = points(6, 23), points(1, 24)
    assert np.allclose(kernel.towards(x)(y[0]), kernel(x, y)[:, 0], rtol=1e-13, atol=1e-15)


def test_names_count_the_inputs_of_the_points():
    assert OnInputs((3, 1), SquaredExponential(1.0, (2.0, 3.0))).names == (
        "variance",
        "length_scales[4]",
        "length_scales[2]",
    )


@every
def test_a_gradient_at_the_same_point_is_finite(kernel):
    x = points(3, 6)
    assert np.all(np.isfinite(kernel.input_gradient(x, x)))
    assert all(np.all(np.isfinite(each)) for each in kernel.value_gradients(x, x))


@every
def test_values_go_out_and_in_again(kernel):
    assert kernel.with_values(kernel.values) == kernel
    assert kernel.with_values(2.0 * kernel.values) != kernel


def test_textbook_values_at_distance_one():
    x, y = np.array([[0.0]]), np.array([[1.0]])
    assert SquaredExponential(2.0, (1.0,))(x, y)[0, 0] == pytest.approx(2.0 * np.exp(-0.5), rel=1e-15)
    assert Matern32(1.0, (1.0,))(x, y)[0, 0] == pytest.approx((1 + 3**0.5) * np.exp(-(3**0.5)), rel=1e-15)
    assert Matern52(1.0, (1.0,))(x, y)[0, 0] == pytest.approx((1 + 5**0.5 + 5 / 3) * np.exp(-(5**0.5)), rel=1e-15)


def test_a_periodic_kernel_repeats_after_each_period():
    kernel = KERNELS["periodic"]
    x, y = points(3, 7), points(3, 8)
    assert np.allclose(kernel(x + np.array([2 * 1.9, -3.1]), y), kernel(x, y), rtol=1e-12)


def test_a_sum_of_columns_is_the_product_of_its_squared_exponentials():
    x, y = points(4, 9), points(4, 10)
    product = OnInputs((0,), SquaredExponential(1.7, (0.8,))) * OnInputs((1,), SquaredExponential(1.0, (2.5,)))
    assert np.allclose(product(x, y), SMOOTH(x, y), rtol=1e-14)


@pytest.mark.parametrize("bad", [0.0, -1.0, float("nan"), float("inf")])
def test_a_value_that_is_not_positive_is_refused_by_name(bad):
    with pytest.raises(MisfitError, match=r"SquaredExponential: length_scales = .* expected positive numbers"):
        SquaredExponential(1.0, (1.0, bad))


def test_points_of_another_size_are_refused():
    with pytest.raises(MisfitError, match="made for 2 inputs, the points have 3"):
        SMOOTH(np.zeros((1, 3)), np.zeros((1, 3)))
