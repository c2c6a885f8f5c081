"""Effects that have two forms are answered in one: a tremor's amplitude is positive, its phase says the rest."""

import numpy as np

from fmus.catalogue import find_modelica_model
from orchestrator.diagnosis.fit.candidates import EffectSet
from orchestrator.diagnosis.fit.canonical import canonical
from orchestrator.diagnosis.fit.extensible import find_candidates
from orchestrator.library.cards import effect_library
from orchestrator.models.estimation import Fit, Record

TIME = np.arange(500) * 0.004
STATES = ("q1", "q2")


def tremor_at_both_joints() -> EffectSet:
    base = find_modelica_model("double-pendulum")
    cards = [card for card in effect_library() if card.id == "tremor"]
    return EffectSet(base, find_candidates(base, base.compile(), cards)[0], STATES)


def run(effects: EffectSet, values: np.ndarray, start: np.ndarray) -> np.ndarray:
    model = effects.model.compiled
    return model.run(TIME, np.zeros((500, len(model.system.inputs))), model.with_values(values), start).outputs


def phases(effects: EffectSet) -> list[int]:
    return [i for i, v in enumerate(effects.model.system.states) if ".phase[" in v.name]


def test_tremor_of_negative_amplitude_is_answered_as_the_same_tremor_half_a_turn_later() -> None:
    effects = tremor_at_both_joints()
    values, start = np.array([-0.02, 0.005, 3.5]), np.linspace(-0.4, 0.3, len(effects.model.system.states))
    start[phases(effects)] = 0.6, -0.8
    low, high = start - 1.0, start + 2.0
    record = Record(TIME, np.zeros((500, 0)), np.zeros((500, 2)), start, np.ones(len(start)), low, high)
    together = np.array([[1.0, 0.2, 0.3], [0.2, 1.0, 0.4], [0.3, 0.4, 1.0]])
    fit = Fit(values, np.ones(3), (start,), 1.0, np.zeros(3, bool), 1000, correlation=together)

    found, (turned,) = canonical(effects, fit, [record])

    np.testing.assert_array_equal(found.values, [0.02, -0.005, 3.5])
    np.testing.assert_array_equal(found.starts[0][phases(effects)], [-0.6, 0.8])
    np.testing.assert_array_equal(run(effects, found.values, found.starts[0]), run(effects, values, start))
    # cov(-a, f) = -cov(a, f), and cov(-a, -b) = cov(a, b)
    np.testing.assert_array_equal(found.correlation, [[1.0, 0.2, -0.3], [0.2, 1.0, -0.4], [-0.3, -0.4, 1.0]])
    # As far from what was expected of the start, and as far from its bounds.
    np.testing.assert_array_equal(found.starts[0] - turned.start, 0.0)
    np.testing.assert_array_equal(turned.start_low[phases(effects)], -high[phases(effects)])
    np.testing.assert_array_equal(turned.start_high[phases(effects)], -low[phases(effects)])


def test_tremor_whose_largest_amplitude_is_positive_stays_as_it_is() -> None:
    effects = tremor_at_both_joints()
    fit = Fit(np.array([0.02, -0.005, 3.5]), np.ones(3), (), 1.0, np.zeros(3, bool), 1000)

    assert canonical(effects, fit, [])[0] is fit


def test_length_of_a_tremors_phase_changes_nothing() -> None:
    """Were it part of the amplitude, each trial's could be anything, and that of all unknown."""
    effects = tremor_at_both_joints()
    values, short = np.array([0.02, 0.01, 3.5]), np.zeros(len(effects.model.system.states))
    short[phases(effects)] = 0.3, 0.4
    long = short.copy()
    long[phases(effects)] = 1.5, 2.0

    there, here = run(effects, values, long), run(effects, values, short)

    assert np.ptp(here, axis=0).min() > 1e-4
    np.testing.assert_allclose(there, here, atol=1e-12)


def test_effects_of_one_form_keep_their_signs() -> None:
    base = find_modelica_model("double-pendulum")
    cards = [card for card in effect_library() if card.id == "constant_force"]
    effects = EffectSet(base, find_candidates(base, base.compile(), cards)[0], STATES)
    fit = Fit(np.array([-0.1, 0.05]), np.ones(2), (), 1.0, np.zeros(2, bool), 1000)

    assert canonical(effects, fit, [])[0] is fit
