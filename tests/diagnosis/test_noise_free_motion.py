"""Taking the noise of an input away leaves a machine where it was: no drift from an impulse that the filter took, too."""

from dataclasses import replace

import numpy as np

from fmus.catalogue import find_modelica_model
from orchestrator.diagnosis.fit.candidates import EffectSet
from orchestrator.diagnosis.fit.evidence import LearningData, Refit, fit_nominal
from orchestrator.diagnosis.linear.noise_free_motion import noise_free_motion, started_like
from orchestrator.models.smoothing import SmoothedTrial

TIME, NOISE, TORQUE_NOISE = np.arange(0, 5, 0.004), np.array([1e-4]), 1e-4
STATES = {"q", "w"}


def pushed(size: float) -> tuple[Refit, LearningData, np.ndarray]:
    """A drive whose torque is largest as the record begins, fitted without effects; and the angle (n, 1) that it truly has."""
    drive, random = find_modelica_model("drive"), np.random.default_rng(5)
    nothing = EffectSet(drive, (), ["phi"])
    model = nothing.model
    torque = size * np.cos(3 * TIME)
    inputs = np.column_stack([torque, np.zeros(len(TIME))])
    true = model.compiled.run(TIME, inputs, model.compiled.parameters, np.zeros(2)).outputs
    shown = inputs + TORQUE_NOISE * np.column_stack([random.standard_normal(len(TIME)), np.zeros(len(TIME))])
    trial = SmoothedTrial(
        TIME, shown, true + NOISE * random.standard_normal(true.shape), NOISE, np.array([TORQUE_NOISE, 0.0])
    )
    learning = LearningData((trial,), NOISE)
    return fit_nominal(nothing, model, learning), learning, true


def along(found: Refit) -> np.ndarray:
    """Outputs (n, ny) of a free run of the only trial."""
    (record,), (start,) = found.records, found.fit.starts
    parameters = found.model.compiled.with_values(found.fit.values)
    return found.model.compiled.run(record.time, record.inputs, parameters, start, substeps=found.substeps).outputs


def rms(series: np.ndarray) -> float:
    return float(np.sqrt(np.mean(series**2)))


def test_motion_along_quiet_inputs_stays_where_the_recorded_inputs_take_it() -> None:
    base, learning, true = pushed(0.1)

    quiet = noise_free_motion(base, learning, np.zeros(base.fit.rows), STATES)

    drifting = replace(quiet, fit=base.fit)
    before = rms(along(base) - true)
    assert rms(along(drifting) - true) > 10 * before  # what the filter does to the impulse
    assert rms(along(quiet) - true) < 1.1 * before


def test_start_values_stay_where_no_input_is_noisy() -> None:
    base, learning, _ = pushed(0.1)
    exact = LearningData((replace(learning.trials[0], input_noise=None),), NOISE)

    quiet = noise_free_motion(base, exact, np.zeros(base.fit.rows), STATES)

    np.testing.assert_array_equal(quiet.fit.starts[0], base.fit.starts[0])
    np.testing.assert_array_equal(along(quiet), along(base))


def test_set_of_effects_begins_as_far_off_as_the_smaller_one_inside_it() -> None:
    base, learning, _ = pushed(0.1)
    quiet = noise_free_motion(base, learning, np.zeros(base.fit.rows), STATES)
    elsewhere = replace(base, fit=replace(base.fit, starts=(base.fit.starts[0] + np.array([0.5, 0.25]),)))

    begun = started_like(elsewhere, base, quiet)

    np.testing.assert_allclose(begun.fit.starts[0] - quiet.fit.starts[0], [0.5, 0.25], rtol=1e-12)
    np.testing.assert_array_equal(begun.records[0].inputs, quiet.records[0].inputs)
