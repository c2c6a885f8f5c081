"""Intervals of fitted parameters: within what the effect's class says that they can be."""

from dataclasses import replace

import numpy as np
import pytest

from orchestrator.diagnosis.free_runs import named_effects
from tests.diagnosis.test_disguise import fitted


@pytest.mark.parametrize(("std", "expected"), [(0.01, (0.98355, 1.01645)), (90.0, None)])
def test_interval_of_a_stiffness_has_five_percent_beyond_each_end_and_ends_with_what_its_class_allows(
    std: float, expected: tuple[float, float] | None
) -> None:
    found = fitted(("passive_stiffness",), 1.0)
    k = [v.name.rpartition(".")[2] for v in found.effects.variables].index("k[1]")
    values = np.ones(found.size)
    found = replace(found, fit=replace(found.fit, values=values, std=std * values))
    low, high = (float(end[k]) for end in found.effects.bounds())

    (effect,) = named_effects(found)

    assert (low, high) == (0.0, 50.0)
    assert effect.parameters["k[1]"].ci90 == pytest.approx(expected or (low, high), abs=1e-5)
