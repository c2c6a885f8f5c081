"""Stated tolerances: which parameters they concern, and what a fit makes of them."""

import numpy as np
import pytest

from fmus.catalogue import find_modelica_model
from fmus.errors import MisfitError
from orchestrator.diagnosis.noise.nuisances import nuisances
from orchestrator.measurements.case_file import relative
from orchestrator.models.compiled import CompiledModel
from orchestrator.models.estimation import Prior, Record, fit

ARM = find_modelica_model("arm").compile()


def test_tolerance_of_an_array_concerns_all_its_elements() -> None:
    found = nuisances(ARM, {"linkage.m": 0.05}, 0.0)

    assert found.names == ("linkage.m[1]", "linkage.m[2]")
    np.testing.assert_allclose(found.std, [0.05 * 1.93, 0.05 * 1.52])


def test_default_concerns_what_is_not_zero_and_gives_way_to_a_name() -> None:
    found = nuisances(ARM, {"default": 0.02, "linkage.l": 0.0}, 0.0)

    assert "d1[5]" not in found.names  # a muscle that does not cross the shoulder
    assert "linkage.l[1]" not in found.names
    assert "linkage.m[1]" in found.names


def test_tolerance_of_an_unknown_parameter_is_refused_by_name() -> None:
    with pytest.raises(MisfitError, match="'mass', which .* does not have; it has .*linkage.m"):
        nuisances(ARM, {"mass": 0.05}, 0.0)


@pytest.mark.parametrize(("given", "expected"), [("5%", 0.05), (0.02, 0.02), ("0.1", 0.1), ("much", None), (1.5, None)])
def test_relative_tolerance_is_a_share_or_a_percentage(given: object, expected: float | None) -> None:
    assert relative(given) == (None if expected is None else pytest.approx(expected))


def test_prior_and_data_share_a_parameter_by_their_precisions() -> None:
    """Linear Gaussian theory: the posterior mean weighs prior and data with their inverse variances."""
    model = CompiledModel(ARM, ["q1", "q2"], ["linkage.b[1]"])
    time, start = np.arange(250) * 0.004, np.array([0.8, 1.2, 0.0, 0.0])
    inputs = np.column_stack([np.full((250, 6), 0.3), np.zeros((250, 4))])
    true = model.run(time, inputs, model.with_values([0.4]), start, substeps=2).outputs
    fixed = Record(time, inputs, true, start, np.full(4, 1e-9), start - 1e-6, start + 1e-6)

    def value(prior: Prior | None) -> tuple[float, float]:
        found = fit(model, [fixed], np.full(2, 3e-3), [0.3], [0.0], [2.0], substeps=2, prior=prior)
        return float(found.values[0]), float(found.std[0])

    alone, together = value(None), value(Prior(np.array([0.3]), np.array([0.05])))

    run = model.run(time, inputs, model.with_values([0.4]), start, substeps=2, sensitivities=True)
    assert run.sensitivities is not None
    precision = np.sum((run.sensitivities[:, :, 4] / 3e-3) ** 2)
    expected = (precision * 0.4 + 0.3 / 0.05**2) / (precision + 1 / 0.05**2)
    assert alone[0] == pytest.approx(0.4, abs=1e-5)
    assert together[0] == pytest.approx(expected, abs=2e-3)


def test_late_outputs_are_recognised_by_how_late_they_are() -> None:
    model = CompiledModel(ARM, ["q1", "q2"])
    time, start = np.arange(1000) * 0.004, np.array([0.8, 1.2, 0.0, 0.0])
    alpha = np.repeat(np.random.default_rng(1).uniform(0.1, 0.6, (10, 6)), 100, axis=0)
    inputs = np.column_stack([alpha, np.zeros((1000, 4))])
    early = model.run(time, inputs, model.parameters, start, substeps=2).outputs
    rate = np.gradient(early, time, axis=0)
    record = Record(time, inputs, early - 0.002 * rate, start, np.full(4, np.inf), start - 1.0, start + 1.0)

    found = fit(model, [record], np.full(2, 1e-5), (), (), (), substeps=2, prior=Prior(np.zeros(0), np.zeros(0), 0.002))

    assert found.shift == pytest.approx(0.002, rel=1e-2)
