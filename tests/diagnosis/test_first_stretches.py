"""Fits of large effects begin over short stretches where fits of whole trials go astray."""

import numpy as np
import pytest

from fmus.catalogue import find_modelica_model
from orchestrator.diagnosis.fit.candidates import EffectSet
from orchestrator.diagnosis.fit.evidence import LearningData, refit
from orchestrator.diagnosis.fit.extensible import find_candidates
from orchestrator.diagnosis.search.fitting import Fitter, Setting
from orchestrator.diagnosis.search.trace import Trace
from orchestrator.library.cards import effect_library
from orchestrator.models.patch import free_slots
from orchestrator.models.smoothing import SmoothedTrial
from orchestrator.work import Here

NOISE = np.array([1e-3])
PENDULUM = find_modelica_model("pendulum")
COGGING = EffectSet(
    PENDULUM,
    find_candidates(PENDULUM, PENDULUM.compile(), [c for c in effect_library() if c.id == "cogging"])[0],
    ["theta"],
)
# Sine, cosine in N.m, waves a turn: steeper than gravity.
RIGHT, FIRST = np.array([1e-3, -2e-2, 13.4]), np.array([0.0, -1e-2, 12.0])


def wedged(values: np.ndarray) -> LearningData:
    """Three trials of a pendulum whose cogging stops it here and lets it run on there."""
    model, time, trials = COGGING.model, np.arange(0, 6, 0.01), []
    nothing, random = np.zeros((len(time), len(model.inputs))), np.random.default_rng(2)
    for angle in (1.2, 2.2, 4.4):
        start = np.array([0.0 if v.name == "w" else angle for v in model.system.states])
        read = model.compiled.run(time, nothing, model.compiled.with_values(values), start, substeps=8).outputs
        trials.append(SmoothedTrial(time, nothing, read + NOISE * random.standard_normal(read.shape), NOISE))
    return LearningData(tuple(trials), NOISE)


def test_large_cogging_is_found_from_a_first_stretch_where_a_fit_of_whole_trials_ends_at_other_waves() -> None:
    learning = wedged(RIGHT)
    nominal, slots = EffectSet(PENDULUM, (), ["theta"]).model, tuple(free_slots(PENDULUM.compile()))
    fitter = Fitter(Setting(PENDULUM, nominal, slots, learning, Here(), 1, lambda message: None, Trace()))
    astray = refit(COGGING, learning, FIRST, tolerance=1e-3)
    assert astray.cost > 1000.0

    found = fitter.from_first_stretch(astray, FIRST)

    assert found.cost == pytest.approx(1.0, abs=5 * (2 / found.fit.rows) ** 0.5)
    assert np.all(np.abs(found.values - RIGHT) < 5 * found.std)
