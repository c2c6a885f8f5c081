"""Intervals of fitted parameters: within what the effect's class says that they can be."""

from dataclasses import replace

import numpy as np
import pytest

from orchestrator.diagnosis.free_runs import named_effects
from tests.diagnosis.test_disguise import fitted


@pytest.mark.parametrize(("std", "expected"), [(0.01, (0.98355, 1.01645)), (90.0, (0.0, 149.037))])
def test_interval_of_a_stiffness_has_five_percent_beyond_each_end_and_ends_with_what_its_class_allows(
    std: float, expected: tuple[float, float]
) -> None:
    found = fitted(("passive_stiffness",), 1.0)
    values = np.ones(found.size)
    found = replace(found, fit=replace(found.fit, values=values, std=std * values))

    (effect,) = named_effects(found)

    assert effect.parameters["k[1]"].ci90 == pytest.approx(expected, rel=1e-4, abs=1e-5)
