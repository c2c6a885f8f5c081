"""What an input did in a gap of its record."""

import numpy as np
import pytest

from fmus.catalogue import find_modelica_model
from orchestrator.diagnosis.fit.candidates import EffectSet
from orchestrator.diagnosis.fit.evidence import Refit
from orchestrator.diagnosis.fit.extensible import model_of
from orchestrator.diagnosis.fit.start_values import beginning_at
from orchestrator.diagnosis.linear.response import Response
from orchestrator.diagnosis.noise.gaps import unknown_in_gaps
from orchestrator.models.smoothing import SmoothedTrial

STEP, RATE, MISSING = 0.004, 40.0, 8


def test_a_gap_is_as_uncertain_as_a_chord_of_a_sine_is_off_its_mean() -> None:
    """A chord over h = 8 steps errs in the mean by sin(w t) (sin(w h/2) / (w h/2) - cos(w h/2)) at its middle."""
    time = np.delete(np.arange(5000) * STEP, np.arange(1000, 1000 + MISSING - 1))
    half = 0.5 * RATE * MISSING * STEP

    found = unknown_in_gaps(time, np.sin(RATE * time))

    assert [np.flatnonzero(column).tolist() for column in found.T] == [[998], [999], [1000], [1001]]
    # The trapezoids beneath the mean err by (w step)^2 / 12, 0.2 %; the sine's root mean square is that of whole turns.
    assert found[999, 1] == pytest.approx((np.sin(half) / half - np.cos(half)) / np.sqrt(2), rel=0.02)


def test_a_record_without_gaps_has_none() -> None:
    time = np.arange(100) * STEP

    assert unknown_in_gaps(time, np.sin(RATE * time)).shape == (100, 0)


def test_an_answer_to_a_change_beside_a_gap_is_a_difference_of_runs() -> None:
    """The shaft of two masses turns by a whole oscillation in the gap: what is done to it at once at either end is not done so."""
    source, signals = find_modelica_model("two-mass"), ("phiMotor", "phiLoad")
    model, nothing = model_of(source, source.compile(), signals), EffectSet(source, (), signals)
    time = np.delete(np.arange(400) * STEP, np.arange(200, 200 + 12))
    trial = SmoothedTrial(time, np.zeros((len(time), 3)), np.zeros((len(time), 2)), np.full(2, 1e-4))
    fitted = Refit(nothing, model, (model.record(trial),), beginning_at(np.zeros(0), (np.zeros(4),)), 40)
    change = 0.01 * (np.arange(len(time)) == 199)

    found = Response(fitted, [trial.smoother]).to_input(0, 0, change[:, None])[:, :, 0]

    moved = np.column_stack([change, np.zeros((len(time), 2))])
    parameters = fitted.model.compiled.with_values(fitted.fit.values)
    runs = [
        fitted.model.compiled.run(time, u, parameters, fitted.fit.starts[0], substeps=40).outputs
        for u in (trial.inputs, moved)
    ]
    assert np.abs(found[:199]).max() == 0.0
    np.testing.assert_allclose(found, runs[1] - runs[0], atol=0.02 * np.ptp(runs[1] - runs[0], axis=0).min())
