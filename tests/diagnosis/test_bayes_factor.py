"""How likely Stribeck friction is beside dry friction that explains as much: by where its rest would have to hide."""

from dataclasses import replace

import numpy as np
import pytest

from fmus.catalogue import find_modelica_model
from orchestrator.diagnosis.decide import bayes_factor as module
from orchestrator.diagnosis.decide.bayes_factor import BayesFactor, BayesFactors, bayes_factor
from orchestrator.diagnosis.fit.candidates import EffectSet
from orchestrator.diagnosis.fit.evidence import LearningData, refit
from orchestrator.diagnosis.fit.extensible import find_candidates
from orchestrator.library.cards import Candidate, effect_library
from orchestrator.models.smoothing import SmoothedTrial

DRIVE = find_modelica_model("drive")
CARDS = [c for c in effect_library() if c.id in ("coulomb_friction", "stribeck_friction") and not c.variant]
DRY, STRIBECK = (
    EffectSet(DRIVE, [c for c in find_candidates(DRIVE, DRIVE.compile(), CARDS)[0] if c.card.id == name], ["phi"])
    for name in ("coulomb_friction", "stribeck_friction")
)
TIME, FRICTION = np.arange(0, 6, 0.01), 0.012


def found_in(
    noise: float, extra: float, by: Candidate = STRIBECK.candidates[0], push: float = 0.0
) -> BayesFactor | None:
    """The room for the rest of Stribeck friction in a record of dry friction, and of `extra` N.m more below 0.5 rad/s.

    `push`: torque in N.m that is added in the last 0.2 s.
    """
    torque = 0.05 * np.sin(2 * np.pi * 0.4 * TIME) + push * (TIME > 5.8)
    inputs = np.column_stack([torque, np.zeros(len(TIME))])
    parameters = STRIBECK.model.compiled.with_values(np.array([FRICTION, extra, 0.5]))
    read = STRIBECK.model.compiled.run(TIME, inputs, parameters, np.zeros(2), substeps=8).outputs
    std = np.array([noise])
    measured = read + noise * np.random.default_rng(6).standard_normal(read.shape)
    learning = LearningData((SmoothedTrial(TIME, inputs, measured, std),), std)
    best = refit(DRY, learning, np.array([FRICTION]))
    astray = refit(STRIBECK, learning, np.array([FRICTION, 1e-6, 3.0]), tolerance=1e3)
    return bayes_factor(best, astray, DRY.candidates[0], by, learning, 1.0)


def test_rest_that_could_hide_only_near_rest_has_no_room() -> None:
    """Below 0.03 rad/s it would act in a few samples of each reversal; no record rules that out, and none needs it."""
    found = found_in(0.01, 0.0)

    assert found is not None
    assert found.likelihood < 0.05
    assert found.hidden == (0.01, pytest.approx(0.027, rel=0.1))


def test_rest_has_room_where_friction_itself_hardly_shows() -> None:
    found = found_in(0.3, 0.0)

    assert found is not None
    assert 0.2 < found.likelihood < 5.0


def test_speeds_of_a_moment_give_no_room_by_themselves(monkeypatch: pytest.MonkeyPatch) -> None:
    """Few samples are that fast, and next to none tell: a rest that acts in all of them was taken for one that acts in most."""
    found = found_in(0.1, 0.0, push=1.0)
    monkeypatch.setattr(module, "ACTS_IN", tuple(np.linspace(0.01, 1.0, 100)))
    closer = found_in(0.1, 0.0, push=1.0)

    assert found is not None
    assert closer is not None
    assert found.likelihood == pytest.approx(closer.likelihood, rel=0.2)


def test_rest_that_is_there_is_likelier_although_its_own_fit_went_astray() -> None:
    found = found_in(0.01, FRICTION)

    assert found is not None
    assert found.likelihood > 1e3


def test_law_whose_card_does_not_say_where_its_rest_acts_is_judged_by_its_fit() -> None:
    needless = replace(STRIBECK.candidates[0], card=replace(STRIBECK.candidates[0].card, needs=()))

    assert found_in(0.01, 0.0, needless) is None


def test_rest_that_would_hide_is_told_where_it_is_not_listed() -> None:
    bayes_factors = BayesFactors(None, LearningData((), np.ones(1)), 1.0)
    bayes_factors._found[DRY.candidates[0], STRIBECK.candidates[0]] = BayesFactor(0.01, "vS", "rad/s", (0.01, 0.32))

    assert bayes_factors.hidden({("coulomb_friction", "stribeck_friction")}) == []
    assert bayes_factors.hidden(set()) == [
        "coulomb_friction is named, not stribeck_friction: that would have to act with vS from 0.01 to 0.32 rad/s, where these"
        " data hardly are"
    ]
