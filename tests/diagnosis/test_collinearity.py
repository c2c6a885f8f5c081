"""Effects that act alike in the data are found by the angles between what they do there."""

import numpy as np
import pytest

from fmus.catalogue import find_modelica_model
from orchestrator.diagnosis.fit.candidates import EffectSet
from orchestrator.diagnosis.fit.evidence import LearningData
from orchestrator.diagnosis.fit.extensible import find_candidates, model_of
from orchestrator.diagnosis.linear.calibration import Colour
from orchestrator.diagnosis.linear.collinearity import collinear_effects, principal_cosines
from orchestrator.diagnosis.noise.nuisances import Nuisances
from orchestrator.diagnosis.search.search import Searcher
from orchestrator.library.cards import effect_library
from orchestrator.models.patch import free_slots
from orchestrator.models.smoothing import SmoothedTrial

DRIVE = find_modelica_model("drive")
TIME = np.arange(0, 6, 0.01)
NOISE = np.array([1e-3])
CARDS = [c for c in effect_library() if c.id in ("viscous_friction", "stimulation_delay", "sensor_lag", "cogging")]


def test_principal_angles_of_two_planes_are_those_they_were_built_with() -> None:
    """Planes spanned by (e1, e2) and (cos a e1 + sin a e3, cos b e2 + sin b e4), seen through any rotation and mixing."""
    a, b = 0.3, 1.1
    first, second = np.eye(6)[:, :2], np.zeros((6, 2))
    second[[0, 2], 0], second[[1, 3], 1] = (np.cos(a), np.sin(a)), (np.cos(b), np.sin(b))
    random = np.random.default_rng(4)
    turned = np.linalg.qr(random.standard_normal((6, 6)))[0]
    mixed = [turned @ part @ random.standard_normal((2, 2)) for part in (first, second)]

    np.testing.assert_allclose(principal_cosines(*mixed), [np.cos(a), np.cos(b)], rtol=1e-12)


def test_space_inside_another_has_no_angle_to_it() -> None:
    columns = np.random.default_rng(1).standard_normal((20, 3))

    np.testing.assert_allclose(principal_cosines(columns[:, :1] * 1e-6, columns), [1.0])


@pytest.fixture(scope="module")
def searched() -> Searcher:
    """The drive under slow torques, its command late by 20 ms; its encoder might as well be."""
    system = DRIVE.compile()
    candidates, _ = find_candidates(DRIVE, system, CARDS)
    late = EffectSet(DRIVE, [next(c for c in candidates if c.card.id == "stimulation_delay")], ["phi"])
    torque = sum(0.05 * np.sin(2 * np.pi * f * TIME + f) for f in (0.3, 0.5, 0.7))
    inputs = np.column_stack([torque, np.zeros(len(TIME))])
    model = late.model
    true = model.compiled.run(TIME, inputs, model.compiled.with_values([0.02]), np.zeros(2), substeps=4).outputs
    measured = true + NOISE * np.random.default_rng(2).standard_normal(true.shape)
    data = LearningData((SmoothedTrial(TIME, inputs, measured, NOISE),), NOISE, nuisances=Nuisances())
    plain = model_of(DRIVE, system, ["phi"])
    return Searcher(DRIVE, plain, free_slots(system), candidates, data, 1, lambda message: None)

    return model_of(DRIVE, DRIVE.compile(), ["phi"])


def test_late_command_and_lagging_encoder_are_collinear_and_cogging_is_not(searched: Searcher) -> None:
    best = searched.run()[-1].refit

    found = {entry.other.card.id: entry for entry in collinear_effects(best, searched.trace.stages)}

    (named,) = best.ids
    twin = {"stimulation_delay": "sensor_lag", "sensor_lag": "stimulation_delay"}[named]
    assert found[twin].relation == "same class"
    assert 0.98 < found[twin].cosine <= 1.0
    assert "cogging" not in found


def test_kin_that_the_search_passed_over_is_refitted_in_place_of_the_best(searched: Searcher) -> None:
    best = searched.trace.refitted[0]
    label = "sensor_lag at sensor:q1"
    kept = [r for r in searched.trace.refitted if r.labels != {label}]
    searched.trace.refitted = list(kept)
    for stage in searched.trace.stages:
        stage.__dict__["colour"] = Colour(np.zeros(1), 1e5)  # noise in which nothing is decisive

    searched.try_collinear(best)

    assert [r.labels for r in searched.trace.refitted[len(kept) :]] == [{label}]
