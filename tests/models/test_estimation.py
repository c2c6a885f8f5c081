"""Fits: known parameters come back, intervals cover, bounds hold."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
import scipy

from fmus.catalogue import find_modelica_model
from orchestrator.models import estimation
from orchestrator.models.compiled import CompiledModel
from orchestrator.models.estimation import Fit, Record, _sandwich, fit

TIME = np.arange(1000) * 0.004
FREE = ["linkage.b[1]", "linkage.b[2]"]
START = np.array([0.8, 1.2, 0.0, 0.0])
SPREAD = np.full(4, np.inf)


def arm() -> CompiledModel:
    return CompiledModel(find_modelica_model("arm").compile(), ["q1", "q2"], FREE)


def trial(model: CompiledModel, seed: int, noise: float) -> Record:
    random = np.random.default_rng(seed)
    alpha = np.repeat(random.uniform(0.1, 0.6, (10, 6)), 100, axis=0)
    inputs = np.column_stack([alpha, np.zeros((1000, 4))])
    true = model.run(TIME, inputs, model.with_values([0.42, 0.25]), START, substeps=4).outputs
    measured = true + noise * random.standard_normal(true.shape)
    guess = START + np.array([0.002, -0.002, 0.05, -0.05])
    return Record(TIME, inputs, measured, guess, SPREAD, START - 1.0, START + 1.0)


def test_fit_recovers_damping_and_start_values_from_clean_data() -> None:
    model = arm()
    records = [trial(model, seed, 0.0) for seed in (1, 2)]

    found = fit(model, records, np.array([1e-4, 1e-4]), [0.1, 0.1], [0, 0], [2, 2], substeps=4)

    np.testing.assert_allclose(found.values, [0.42, 0.25], rtol=1e-5)
    np.testing.assert_allclose(found.starts[0], START, atol=1e-5)


def test_ninety_percent_intervals_cover_the_truth_about_nine_times_in_ten() -> None:
    model = arm()
    inside = 0
    for seed in range(20):
        found = fit(model, [trial(model, seed, 5e-4)], np.array([5e-4, 5e-4]), [0.3, 0.3], [0, 0], [2, 2], substeps=2)
        inside += int(np.sum(np.abs(found.values - [0.42, 0.25]) < 1.645 * found.std))
    # 40 intervals at 90 %: fewer than 29 would happen once in a thousand runs; all 40 would be too wide to be useful.
    assert inside >= 29


def test_start_values_at_their_bounds_are_searched_from_off_them_unless_a_fit_has_found_them_there(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Friction of two joints that yield both ways, -1 and 1 at first: 219 times the noise was left after five steps."""
    model, begun, search = arm(), list[np.ndarray](), scipy.optimize.least_squares

    def looked_at(residual: Any, guess: np.ndarray, *rest: Any, **options: Any) -> Any:
        begun.append(guess)
        return search(residual, guess, *rest, **options)

    monkeypatch.setattr(scipy.optimize, "least_squares", looked_at)
    low, high = START - 1.0, START + np.array([1.0, 1.0, 1.0, np.inf])
    record = replace(
        trial(model, 6, 0.0), start=np.array([low[0], high[1], 0.3, low[3]]), start_low=low, start_high=high
    )
    first, noise = [0.3, 0.3], np.array([1e-4, 1e-4])

    found = fit(model, [record], noise, first, [0, 0], [2, 2], substeps=2)
    there = replace(found, starts=(record.start,))
    fit(model, [record], noise, first, [0, 0], [2, 2], substeps=2, earlier=there)

    np.testing.assert_allclose(begun[0][2:], [low[0] + 0.1, high[1] - 0.1, 0.3, low[3]])
    np.testing.assert_array_equal(begun[1][2:], record.start)
    np.testing.assert_allclose(found.starts[0], START, atol=1e-4)


def test_parameter_stops_at_its_bound_and_is_reported_there() -> None:
    model = arm()
    found = fit(model, [trial(model, 3, 0.0)], np.array([1e-4, 1e-4]), [0.1, 0.1], [0, 0], [0.3, 2], substeps=2)

    assert found.values[0] <= 0.3
    assert list(found.at_bound) == [True, False]


def test_small_value_that_the_data_tell_apart_from_zero_is_not_at_its_bound() -> None:
    model = arm()
    inputs = trial(model, 4, 0.0).inputs
    measured = model.run(TIME, inputs, model.with_values([1e-4, 0.25]), START, substeps=4).outputs
    record = Record(TIME, inputs, measured, START, SPREAD, START - 1.0, START + 1.0)

    found = fit(model, [record], np.array([1e-4, 1e-4]), [0.1, 0.1], [0, 0], [5, 5], substeps=4)

    np.testing.assert_allclose(found.values, [1e-4, 0.25], rtol=1e-2)
    assert not found.at_bound.any()


def test_parameters_keep_their_first_values_if_the_data_depend_on_nothing() -> None:
    model = arm()

    found = fit(model, [trial(model, 3, 0.0)], np.ones(2), [0.1, 0.2], [0, 0], [2, 2], substeps=2, reduce=np.zeros_like)

    assert list(found.values) == [0.1, 0.2]
    assert np.isinf(found.std).all()


def test_fit_of_runs_that_take_too_long_is_given_up_and_says_so(monkeypatch: pytest.MonkeyPatch) -> None:
    model = arm()
    record = trial(model, 5, 0.0)

    def fitted() -> Fit:
        return fit(model, [record], np.array([1e-4, 1e-4]), [0.1, 0.1], [0, 0], [2, 2], substeps=2)

    settled = fitted()
    monkeypatch.setattr(estimation, "MOST_OPERATIONS", 0)
    monkeypatch.setattr(estimation, "FEWEST", 2)
    given_up = fitted()

    assert settled.converged and not given_up.converged
    assert given_up.cost > settled.cost


def test_deviations_scale_with_a_parameter_whatever_its_slopes_are() -> None:
    """Slopes of 1e200, along a run that nearly diverges, have squares that are no numbers."""
    random = np.random.default_rng(1)
    residual, jacobian = random.normal(size=60), random.normal(size=(60, 2))
    std, correlation = _sandwich(residual, jacobian, [0, 20, 40, 60], 2)
    scaled, same = _sandwich(residual, jacobian * [1e200, 1.0], [0, 20, 40, 60], 2)

    assert scaled == pytest.approx(std / [1e200, 1.0])
    assert same == pytest.approx(correlation)


def test_a_fit_counts_the_operations_of_all_its_runs() -> None:
    model = arm()
    records = [trial(model, seed, 0.0) for seed in (1, 2)]
    noise, runs = np.array([1e-4, 1e-4]), 0.0

    def counted(series: np.ndarray) -> np.ndarray:
        nonlocal runs
        runs += 1  # once for each trial
        return series

    found = fit(model, records, noise, [0.1, 0.1], [0, 0], [2, 2], substeps=4, reduce=counted)

    # Four stages of four steps a sample.
    assert found.operations == runs / 2 * 4 * 4 * (2 * len(TIME)) * model.operations
    assert runs > 4
