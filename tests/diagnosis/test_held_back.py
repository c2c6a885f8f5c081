"""What a delay holds back when a record begins while an input is on its way."""

import numpy as np
import pytest

from fmus.catalogue import find_modelica_model
from orchestrator.diagnosis.candidates import EffectSet, find_candidates
from orchestrator.diagnosis.cards import effect_library
from orchestrator.diagnosis.evidence import LearningData, fit_nominal, refit
from orchestrator.diagnosis.noise_model import metrics_of
from orchestrator.diagnosis.response import Response
from orchestrator.measurements import Noise
from orchestrator.models.held_back import HELD_BACK, sizes_before
from orchestrator.models.smoothing import SmoothedTrial

DRIVE = find_modelica_model("drive")
STEP, INERTIA, NOISE = 0.004, 0.02, 1e-6


def angle(torque: np.ndarray, speed: float) -> np.ndarray:
    """Exact angle of an inertia at half steps, for a torque that is straight between them."""
    h, rates = 0.5 * STEP, torque / INERTIA
    speeds = speed + np.r_[0.0, np.cumsum(0.5 * h * (rates[1:] + rates[:-1]))]
    moves = h * speeds[:-1] + h**2 * (2 * rates[:-1] + rates[1:]) / 6
    return np.asarray(np.r_[0.0, np.cumsum(moves)])


def delayed_trial(phase: float, random: np.random.Generator) -> SmoothedTrial:
    """A drive whose torque acts a sample and a half late; the record begins in the middle of a swing."""
    fine = np.arange(-100, 2000) * 0.5 * STEP
    sampled = fine[::2]
    torque = np.interp(fine, sampled, 0.05 * np.sin(40.0 * sampled + phase))
    late = np.r_[np.full(3, torque[0]), torque[:-3]]
    seen = slice(100, None, 2)
    phi = angle(late, 0.3)[seen] + NOISE * random.standard_normal(1000)
    inputs = np.column_stack([torque[seen], np.zeros(1000)])
    return SmoothedTrial(fine[seen], inputs, phi[:, None], np.array([NOISE]))


def test_delay_is_found_though_nobody_recorded_what_it_held_back_at_the_start() -> None:
    """A model that holds the first torque for 6 ms is off by an impulse; its start must be free to make up for it."""
    random = np.random.default_rng(4)
    trials, noise = tuple(delayed_trial(phase, random) for phase in (0.0, 1.0, 2.5)), np.array([NOISE])
    delay = [
        c for c in find_candidates(DRIVE, DRIVE.compile(), effect_library())[0] if c.card.id == "stimulation_delay"
    ]
    found = EffectSet(DRIVE, delay, ["phi"])
    nominal = EffectSet(DRIVE, (), ["phi"])
    first = fit_nominal(nominal, nominal.model, LearningData(trials, noise))
    metrics = metrics_of(Response(first, [t.smoother for t in trials]), [Noise(NOISE)], [Noise(0.0), Noise(0.0)])

    late = refit(found, LearningData(trials, noise, tuple(metrics)), np.array([0.015]))

    assert first.cost > 100.0
    assert late.values[0] == pytest.approx(1.5 * STEP, abs=max(5 * late.std[0], 1e-5))
    assert late.cost == pytest.approx(1.0, abs=5 * np.sqrt(2 / late.fit.rows))


def test_an_input_that_is_held_at_first_holds_nothing_back() -> None:
    assert not sizes_before(np.r_[np.full(40, 0.3), np.linspace(0, 1, 60)]).any()


def test_a_ramp_was_as_far_off_as_it_goes_in_as_many_samples() -> None:
    np.testing.assert_allclose(sizes_before(0.5 * np.arange(200)), 0.5 * np.arange(HELD_BACK, 0, -1))
