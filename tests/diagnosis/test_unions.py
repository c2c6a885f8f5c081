"""Which sets are put together from fitted ones."""

from types import SimpleNamespace
from typing import Any

import numpy as np

from fmus.catalogue import find_modelica_model
from orchestrator.diagnosis.fit.extensible import find_candidates
from orchestrator.diagnosis.search.proposals import unions
from orchestrator.library.cards import Candidate, effect_library
from orchestrator.models.patch import free_slots

SYSTEM = find_modelica_model("drive").compile()
SLOTS = free_slots(SYSTEM)
ALL = {c.card.id: c for c in find_candidates(find_modelica_model("drive"), SYSTEM, effect_library())[0]}


def fitted(**values: list[float]) -> Any:
    """A fitted set with so many parameters of each effect."""
    candidates = [ALL[name] for name in values]
    owners = [k for k, each in enumerate(values.values()) for _ in each]
    effects = SimpleNamespace(candidates=tuple(candidates), owners=lambda: owners)
    labels = frozenset(c.label for c in candidates)
    return SimpleNamespace(effects=effects, labels=labels, values=np.array(sum(values.values(), [])))


def names(candidates: tuple[Candidate, ...]) -> list[str]:
    return [c.card.id for c in candidates]


def test_two_fitted_effects_are_put_together_with_the_values_of_both() -> None:
    best, other = fitted(viscous_friction=[0.1]), fitted(cogging=[0.2, 0.3, 7.0])
    (both,) = unions([best, other], SLOTS)
    assert names(both.candidates) == ["viscous_friction", "cogging"]
    assert both.values.tolist() == [0.1, 0.2, 0.3, 7.0]
    assert len({c.slot for c in both.candidates}) == 2


def test_two_fitted_pairs_are_put_together_only_if_they_share_an_effect() -> None:
    best = fitted(viscous_friction=[0.1], cogging=[0.2, 0.3, 7.0])
    sharing, other = fitted(cogging=[0.4, 0.5, 8.0], sensor_lag=[0.01]), fitted(sensor_lag=[0.02], constant_force=[1.0])
    (triple,) = unions([best, other, sharing], SLOTS)
    assert names(triple.candidates) == ["viscous_friction", "cogging", "sensor_lag"]
    assert triple.values.tolist() == [0.1, 0.2, 0.3, 7.0, 0.01]


def test_a_set_inside_the_best_one_adds_nothing() -> None:
    best = fitted(viscous_friction=[0.1], cogging=[0.2, 0.3, 7.0])
    assert unions([best, fitted(cogging=[0.4, 0.5, 8.0])], SLOTS) == []


def test_a_law_is_not_put_together_with_one_that_holds_it() -> None:
    best, other = fitted(coulomb_friction=[0.1]), fitted(stribeck_friction=[0.1, 0.05, 0.2])
    assert unions([best, other], SLOTS) == []
