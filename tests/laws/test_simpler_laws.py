"""A law in place of what the library names: tried alone, and better where it is simpler, likelier and predicts no worse."""

from types import SimpleNamespace
from typing import Any

import pytest

from orchestrator.laws import find
from orchestrator.laws.find import Limits, find_laws


def test_terms_that_are_seen_beside_a_named_set_are_fitted_in_its_place_too(monkeypatch: pytest.MonkeyPatch) -> None:
    fitted: list[tuple[Any, ...]] = []
    given, named = SimpleNamespace(candidates=()), SimpleNamespace(candidates=("leak", "overflow"))
    seen = {id(given): ["spring"], id(named): ["saturating loss"]}
    monkeypatch.setattr(find, "guessed", lambda outcome, about, progress: (seen[id(about)], 1))

    def fit(outcome: Any, about: Any, guesses: Any, limits: Limits, until: float, progress: Any) -> list[Any]:
        fitted.append((about.candidates, guesses, len(limits.fitted)))
        return []

    monkeypatch.setattr(find, "_fitted", fit)
    monkeypatch.setattr(find, "_judged", lambda *everything: ())
    outcome: Any = SimpleNamespace(nominal=given, decision=SimpleNamespace(chosen=named))

    find_laws(outcome)

    sizes = len(Limits().fitted)
    assert fitted == [
        ((), ["spring"], sizes),
        (("leak", "overflow"), ["saturating loss"], sizes),
        ((), ["saturating loss"], 1),
    ]


@pytest.mark.parametrize(
    ("constants", "ratio", "better"), [(2, 0.99, True), (2, 1.05, False), (6, 0.99, False), (6, 0.8, True)]
)
def test_a_law_with_fewer_constants_need_not_predict_better(constants: int, ratio: float, better: bool) -> None:
    judge: Any = SimpleNamespace(
        nominal=SimpleNamespace(counted=6),
        limits=SimpleNamespace(worse=0.02),
        defeats=lambda law, about: False,
        beyond_doubt=lambda law, about: True,
        explained=lambda law: 1.0,
        best_ratio=lambda law, about: ratio,
    )
    law: Any = SimpleNamespace(fitted=SimpleNamespace(counted=constants))
    assert find._better(law, judge, Limits()) is better
