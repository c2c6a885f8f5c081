"""A shaft's stiffness and the motor's share make up for each other below the resonance: fits must find the right resonance."""

import numpy as np
import pytest

from fmus.catalogue import find_modelica_model
from orchestrator.diagnosis.fit.candidates import EffectSet
from orchestrator.diagnosis.fit.evidence import LearningData, refit
from orchestrator.diagnosis.fit.extensible import find_candidates
from orchestrator.diagnosis.fit.valley import minima_along, shapes_in_valleys
from orchestrator.library.cards import effect_library
from orchestrator.models.smoothing import SmoothedTrial
from tests.benchmarks.diagnosis.truth.machines import MACHINES
from tests.benchmarks.diagnosis.truth.native import simulate

STEP, EVERY, NOISE = 1e-3, 4, 1e-5
STIFFNESS, DAMPING, SHARE = 211.0, 0.02, 0.38


def swings() -> LearningData:
    """Two trials of an elastic drive by the truth simulator, its torque straight between samples."""
    inertia, trials = MACHINES["drive"].values["J"], []
    values = {"JMotor": SHARE * inertia, "JLoad": (1 - SHARE) * inertia, "k": STIFFNESS, "d": DAMPING}
    for seed in range(2):
        random, fine = np.random.default_rng(seed), np.arange(3000 * EVERY + 1) * STEP
        time = fine[::EVERY]
        tones = sum(a * np.sin(2 * np.pi * hz * time + random.uniform(0, 6)) for a, hz in ((0.1, 0.4), (0.3, 3.1)))
        u = np.interp(fine, time, np.asarray(tones))[:, None]
        q, _ = simulate("two-mass", values, u, [0.0, 0.0], [0.0, 0.0], step=STEP)
        shown = q[::EVERY, :1] + NOISE * random.normal(size=(len(time), 1))
        inputs = np.column_stack([tones, np.zeros(len(time))])
        # The record begins a second after the torque, as most do.
        trials.append(SmoothedTrial(time[250:], inputs[250:], shown[250:], np.array([NOISE])))
    return LearningData(tuple(trials), np.array([NOISE]))


def test_resonance_is_found_from_a_fit_that_ended_at_another_one() -> None:
    base, learning = find_modelica_model("drive"), swings()
    cards = [card for card in effect_library() if card.id == "joint_elasticity"]
    effects = EffectSet(base, find_candidates(base, base.compile(), cards)[0], ("phi",))
    astray = refit(effects, learning, np.array([90.0, 0.02, 0.6]))
    names = [v.name.rsplit(".", 1)[-1] for v in effects.variables]
    assert abs(astray.values[names.index("share")] - SHARE) > 0.1
    assert [names[k] for k in shapes_in_valleys(astray)] == ["share"]

    (shape,) = shapes_in_valleys(astray)
    found = min((refit(effects, learning, row) for row in minima_along(astray, learning, shape)), key=lambda r: r.cost)

    assert found.cost == pytest.approx(1.0, abs=5 * np.sqrt(2 / found.fit.rows))
    for name, value in (("k", STIFFNESS), ("share", SHARE)):
        k = names.index(name)
        assert found.values[k] == pytest.approx(value, abs=4 * found.std[k] + 1e-3 * value)
