"""A law that the data want beyond the limit of what it can be is another law in disguise."""

from typing import Any, cast

import numpy as np
import pytest

from fmus.catalogue import find_modelica_model
from orchestrator.diagnosis.fit.candidates import EffectSet
from orchestrator.diagnosis.fit.evidence import Refit
from orchestrator.diagnosis.fit.extensible import find_candidates
from orchestrator.library.cards import effect_library
from orchestrator.models.estimation import Fit


def fitted(effect: str, values: list[float], std: list[float], at_bound: list[bool]) -> Refit:
    base = find_modelica_model("drive")
    cards = [card for card in effect_library() if card.id == effect]
    effects = EffectSet(base, find_candidates(base, base.compile(), cards)[0][:1], ("phi",))
    found = Fit(np.array(values), np.array(std), (), 1.0, np.array(at_bound), 1000)
    return Refit(effects, cast(Any, None), (), found, 1)


@pytest.mark.parametrize(
    ("waves", "std", "at_bound", "pressed"),
    [
        (2.0, 0.05, True, True),
        (60.0, 0.05, True, True),
        (2.0, 5.0, True, False),  # the data know nothing of the waves
        (2.5, 0.05, False, False),
    ],
)
def test_cogging_of_fewer_waves_than_cogging_has_is_pressed(
    waves: float, std: float, at_bound: bool, pressed: bool
) -> None:
    found = fitted("cogging", [0.1, 0.1, waves], [0.01, 0.01, std], [False, False, at_bound])

    assert bool(found.pressed()) is pressed


def test_friction_at_its_limit_of_none_is_absent_and_not_pressed() -> None:
    assert fitted("viscous_friction", [0.0], [1e-9], [True]).pressed() == ()


@pytest.mark.parametrize(
    ("sizes_std", "waves_std", "pressed"),
    [
        (1e-4, 3.5, True),  # three terms of a series for any smooth force
        (1e-6, 3.5, False),  # the sizes are known: of so many waves that the record shows
        (1e-4, 0.01, False),  # the waves are
    ],
)
def test_cogging_of_which_neither_waves_nor_sizes_are_known_is_another_law(
    sizes_std: float, waves_std: float, pressed: bool
) -> None:
    found = fitted("cogging", [-3e-5, 1e-5, 3.0], [sizes_std, sizes_std, waves_std], [False] * 3)

    assert bool(found.pressed()) is pressed


def test_friction_that_two_joints_share_has_no_shape_to_be_unknown() -> None:
    assert fitted("viscous_friction", [0.1], [0.2], [False]).pressed() == ()
