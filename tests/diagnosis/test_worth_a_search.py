"""When a search begins, and when it goes on."""

from types import SimpleNamespace
from typing import Any, cast

import pytest

from orchestrator.diagnosis.search.search import Searcher


def stage(p_value: float, *, matters: bool, structured: bool, ids: tuple[str, ...]) -> Any:
    tangent = SimpleNamespace(base=SimpleNamespace(ids=ids))
    return cast(Any, SimpleNamespace(p_value=p_value, may_matter=matters, is_structured=structured, tangent=tangent))


@pytest.mark.parametrize("ids", [(), ("payload",)])
@pytest.mark.parametrize(
    ("p_value", "matters", "structured", "worth"),
    [
        (0.005, True, True, True),
        (0.005, False, False, False),
        (0.5, True, False, False),
        # A tremor of the frequency of the record is no sum of what effects do at frequencies of their own.
        (0.86, True, True, True),
    ],
)
def test_errors_that_no_effect_explains_to_first_order_are_searched_as_long_as_they_are_no_noise(
    p_value: float, matters: bool, structured: bool, worth: bool, ids: tuple[str, ...]
) -> None:
    assert Searcher._worth_a_search(stage(p_value, matters=matters, structured=structured, ids=ids)) is worth
