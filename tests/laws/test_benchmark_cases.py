"""The benchmark of hidden effects covers what it claims, and its simplest forms are forms that can be found."""

from pathlib import Path

import numpy as np
import pytest

from fmus.catalogue import find_modelica_model
from orchestrator.greybox.places import Place
from orchestrator.laws.terms import terms_at
from tests.benchmarks.laws.cases import CASES
from tests.benchmarks.laws.plants import PLANTS, Plant

UNITS = {"force": "N", "speed": "m/s", "position": "m", "centre": "m", "time": "s", "of_u": "V", "state": "K"}


def test_sixty_effects_hide_in_the_plants_and_one_null_in_each() -> None:
    nulls = [case for case in CASES if case.name == "nothing"]
    assert len(CASES) - len(nulls) >= 60
    assert {case.plant for case in nulls} == {case.plant for case in CASES} == set(PLANTS)


def test_every_simplest_form_is_a_sum_of_terms_of_the_vocabulary() -> None:
    places = [
        Place(kind, "x", "N", units=UNITS, scales=dict.fromkeys(UNITS, 1.0), storage=1.0)
        for kind in ("motion", "storage")
    ]
    known = [{term.id for term in terms_at(place, ["of_u", "of_i"])} for place in places]
    for case in CASES:
        for terms in case.simplest:
            assert any(terms <= own for own in known), (case.plant, case.name, terms)


@pytest.mark.slow
@pytest.mark.parametrize("plant", PLANTS.values(), ids=PLANTS)
def test_a_model_as_its_user_writes_it_has_the_rates_of_the_truth(plant: Plant, tmp_path: Path) -> None:
    file = tmp_path / f"{plant.model}.mo"
    file.write_text(plant.text)
    system = find_modelica_model(f"{file}:{plant.model}").compile()
    values = dict(zip(plant.names, np.random.default_rng(1).uniform(0.1, 0.5, len(plant.states)), strict=True))
    state = [values[v.name] for v in system.states]
    rates, _ = system.rhs(0.0, state, [0.3], [], [v.start for v in system.parameters])
    expected = dict(zip(plant.names, plant.rates(0.3, list(values.values()), {}), strict=True))
    np.testing.assert_allclose(np.array(rates).ravel(), [expected[v.name] for v in system.states], rtol=1e-12)
