"""The benchmark of hidden effects covers what it claims, and its simplest forms are forms that can be found."""

from orchestrator.greybox.places import Place
from orchestrator.laws.terms import terms_at
from tests.benchmarks.laws.cases import CASES
from tests.benchmarks.laws.plants import PLANTS

UNITS = {"force": "N", "speed": "m/s", "position": "m", "centre": "m", "time": "s", "of_u": "V", "state": "K"}


def test_sixty_effects_hide_in_seven_plants_and_one_null_in_each() -> None:
    nulls = [case for case in CASES if case.name == "nothing"]
    assert len(CASES) - len(nulls) >= 60
    assert {case.plant for case in nulls} == {case.plant for case in CASES} == set(PLANTS)


def test_every_simplest_form_is_a_sum_of_terms_of_the_vocabulary() -> None:
    for case in CASES:
        kind = "motion" if len(PLANTS[case.plant].states) == 2 else "storage"
        place = Place(kind, "x", "N", units=UNITS, scales=dict.fromkeys(UNITS, 1.0))
        known = {term.id.replace("of_of_u", "of_u") for term in terms_at(place, ["of_u"])}
        for terms in case.simplest:
            missing = {term for term in terms if term not in known and term.replace("_of_u", "_of_of_u") not in known}
            assert not missing, (case.plant, case.name, sorted(known & {"loss_times_of_u"}))
