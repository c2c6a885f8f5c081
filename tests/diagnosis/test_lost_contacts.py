"""A set with contacts whose runs are lost is followed to the end, though others leave as much or less of the error."""

from types import SimpleNamespace
from typing import Any, cast

from orchestrator.diagnosis.fit.evidence import Refit
from orchestrator.diagnosis.search.fitting import lost_contacts


def rough(names: str, cost: float) -> Refit:
    ids = tuple(names.split("+"))
    return cast(
        Any, SimpleNamespace(ids=ids, cost=cost, half_bic=cost, effects=SimpleNamespace(contacts="backlash" in ids))
    )


LOST = [rough("sensor_lag", 100.0), rough("tremor", 101.0), rough("joint_scale", 102.0), rough("cogging", 104.0)]
PLAY, PLAY_AND_MORE = rough("backlash", 110.0), rough("backlash+tremor", 103.0)


def test_smallest_set_with_contacts_is_followed_where_all_leave_much_more_than_noise() -> None:
    assert lost_contacts([*LOST, PLAY_AND_MORE, PLAY]) == [PLAY]
    assert lost_contacts(LOST) == []


def test_none_is_followed_where_another_set_comes_near_noise() -> None:
    assert lost_contacts([rough("viscous_friction", 8.0), *LOST, PLAY]) == []


def test_none_is_followed_beside_one_of_the_first() -> None:
    assert lost_contacts([rough("backlash+sensor_lag", 90.0), *LOST, PLAY]) == []
