"""The next experiment: what refitting imitates does not count, and the choice separates what it should."""

import csv
import io
from dataclasses import replace
from typing import Any, cast

import numpy as np
import pytest
from scipy.stats import norm

from fmus.catalogue import ModelicaModel, find_modelica_model
from fmus.symbolic.system import Variable
from orchestrator.diagnosis.advise import next_experiment
from orchestrator.diagnosis.advise.menu import menu
from orchestrator.diagnosis.advise.next_experiment import INSEPARABLE, Explanation, plan
from orchestrator.diagnosis.advise.remaining import remaining
from orchestrator.diagnosis.advise.thresholds import HOPELESS
from orchestrator.diagnosis.decide.excitation import unseen
from orchestrator.diagnosis.fit.candidates import EffectSet
from orchestrator.diagnosis.fit.evidence import LearningData, Refit
from orchestrator.diagnosis.fit.extensible import find_candidates, model_of
from orchestrator.diagnosis.noise.nuisances import Nuisances
from orchestrator.library.cards import effect_library
from orchestrator.models.estimation import Fit
from orchestrator.models.smoothing import SmoothedTrial

DRIVE, MUSCLE, TANKS = (find_modelica_model(name) for name in ("drive", "muscle", "tanks"))
TIME = np.arange(0, 4, 0.01)
NOISE = np.array([1e-3])


def explanation(effect: str, values: list[float], base: ModelicaModel = DRIVE) -> Explanation:
    system = base.compile()
    candidate = next(c for c in find_candidates(base, system, effect_library())[0] if c.card.id == effect)
    effects = EffectSet(base, [candidate], system.outputs)
    low, high = effects.bounds()
    start = effects.system.initial(effects.model.compiled.with_values(values)).full().ravel()
    return Explanation(effect, effects.model, np.array(values), low, high, start)


def learning(torque: np.ndarray) -> LearningData:
    """One trial of the drive; the measured angle only sets the range that experiments may use."""
    phi = np.linspace(-3, 3, len(TIME))[:, None]
    inputs = np.column_stack([torque, np.zeros(len(TIME))])
    return LearningData((SmoothedTrial(TIME, inputs, phi, NOISE),), NOISE)


def test_delay_and_lag_that_a_slow_input_cannot_separate_are_separated_by_the_chosen_one() -> None:
    """exp(-Ts) and 1/(1 + Ts) differ by (wT)^2/2 only: 0.0003 at 0.2 Hz and 20 ms, against a noise of 2 % of the force."""
    slow = np.column_stack([0.5 - 0.4 * np.cos(2 * np.pi * 0.2 * TIME), np.full(len(TIME), 0.043), np.zeros(len(TIME))])
    members = [
        explanation("activation_dynamics", [0.02, 0.02], MUSCLE),
        explanation("stimulation_delay", [0.02], MUSCLE),
    ]
    force = members[1].model.compiled.run(TIME, slow, members[1].model.compiled.with_values([0.02]), members[1].start)
    noise = 0.02 * np.ptp(force.outputs, axis=0)
    data = LearningData((SmoothedTrial(TIME, slow, force.outputs, noise),), noise)

    found = plan(members, data)

    assert found is not None
    assert found.experiment.name != "repeat"
    assert found.separation > 10 * found.repeat[0]
    assert found.probability > found.repeat[1]
    samples = len(found.experiment.time)
    worth = samples * found.separation
    assert found.probability == pytest.approx(norm.cdf((0.5 * worth - np.log(20)) / np.sqrt(worth)))
    assert found.to_json()["effects"] == ["activation_dynamics", "stimulation_delay"]


def test_two_names_of_one_effect_are_not_separated_by_anything() -> None:
    members = [explanation("viscous_friction", [0.05]), explanation("viscous_friction", [0.04])]

    found = plan(members, learning(0.05 * np.sin(2 * TIME)))

    assert found is not None
    # Refitting makes them equal up to the accuracy of the fit, far below the noise.
    assert found.separation < 1e-2


def test_refit_that_loses_its_way_separates_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    """An offset of a force sensor and a constant force are one in any record; a refit along an arm that runs away left 1.8."""
    lost = Fit(np.array([0.5]), np.ones(1), (), 1.8, np.zeros(1, bool), len(TIME), correlation=np.eye(1))
    monkeypatch.setattr(next_experiment, "fit", lambda *_, **__: lost)
    members = [explanation("viscous_friction", [0.05]), explanation("viscous_friction", [0.05])]

    found = plan(members, learning(0.05 * np.sin(2 * TIME)))

    assert found is not None
    assert found.separation == 0.0


def test_experiments_stay_within_the_inputs_that_were_seen() -> None:
    data = learning(0.05 * np.sin(2 * TIME) + 0.01)

    for experiment in menu(DRIVE.compile().inputs, data.trials):
        seen = data.trials[0].inputs
        assert np.all(experiment.inputs >= seen.min(axis=0) - 1e-12)
        assert np.all(experiment.inputs <= seen.max(axis=0) + 1e-12)


def test_input_table_can_be_played() -> None:
    members = [explanation("viscous_friction", [0.05]), explanation("coulomb_friction", [0.02])]
    found = plan(members, learning(0.04 * np.sin(2 * TIME)))
    assert found is not None

    rows = list(csv.DictReader(io.StringIO(found.csv())))

    assert list(rows[0]) == ["time", "torque", "correction_phi"]
    np.testing.assert_allclose([float(row["torque"]) for row in rows], found.experiment.inputs[:, 0], rtol=1e-8)


def test_one_explanation_needs_no_experiment() -> None:
    assert plan([explanation("viscous_friction", [0.05])], learning(0.04 * np.sin(2 * TIME))) is None


def test_silent_muscle_is_driven_like_the_others_and_what_a_bench_may_not_have_is_left() -> None:
    variables = [
        Variable("alpha_1", "1"),
        Variable("alpha_2", "1"),
        Variable("push", "N"),
        Variable("correction_q", "1"),
    ]
    inputs = np.column_stack([0.3 + 0.2 * np.sin(TIME), *[np.zeros(len(TIME))] * 3])
    trial = SmoothedTrial(TIME, inputs, np.sin(TIME)[:, None], NOISE)

    for experiment in menu(variables, [trial])[1:]:
        assert np.ptp(experiment.inputs[:, 1]) > 0
        assert experiment.inputs[:, 1].max() <= inputs[:, 0].max() + 1e-12
        assert not experiment.inputs[:, 2:].any()


def test_drive_that_only_coasted_is_driven_as_far_as_it_stays_where_it_was() -> None:
    """Viscous and dry friction brake a wheel that keeps its speed alike; driven back and forth they do not."""
    members = [explanation("viscous_friction", [0.02]), explanation("coulomb_friction", [0.02])]
    data = learning(np.zeros(len(TIME)))

    found = plan(members, data)

    assert found is not None
    assert np.ptp(found.experiment.inputs[:, 0]) > 0
    assert not found.experiment.inputs[:, 1].any()
    assert found.probability > 0.95
    model, run = members[0].model, found.experiment
    outputs = model.compiled.run(run.time, run.inputs, model.compiled.with_values([0.02]), members[0].start).outputs
    assert np.all(np.abs(outputs) <= 6.0)  # the wheel turned from -3 to 3 rad; half of that to either side is allowed


def test_machine_that_only_rested_is_let_go_away_from_rest() -> None:
    trial = SmoothedTrial(TIME, np.zeros((len(TIME), 0)), np.full((len(TIME), 1), 3.14), NOISE)

    offsets = [experiment.start_offset for experiment in menu([], [trial], rest="rad")[1:]]

    assert offsets == [0.2, 0.5, 1.0]


def test_noise_that_counts_too_much_in_the_metric_does_not_hide_what_separates() -> None:
    """With a tenth of the noise's power a separation is worth ten times the rows."""
    members = [explanation("viscous_friction", [0.05]), explanation("coulomb_friction", [0.02])]
    data = learning(0.0005 * np.sin(2 * TIME))

    usual, quiet = plan(members, data), plan(members, data, 0.1)

    assert usual is not None and quiet is not None
    for found, rows in ((usual, len(TIME)), (quiet, 10 * len(TIME))):
        worth = rows * found.repeat[0]
        assert found.repeat[1] == pytest.approx(norm.cdf((0.5 * worth - np.log(20)) / np.sqrt(worth)))


def test_machine_at_rest_whose_model_has_more_outputs_than_were_measured_gets_an_experiment() -> None:
    system = TANKS.compile()
    candidates = find_candidates(TANKS, system, effect_library())[0]
    time = np.arange(300.0)
    level = (1e-4 / 5e-5) ** 2 / (2 * 9.81)
    inputs = np.column_stack([np.full(300, 1e-4), np.zeros((300, len(system.inputs) - 1))])
    noise = np.full(2, 1e-4)
    data = LearningData((SmoothedTrial(time, inputs, np.full((300, 2), level), noise),), noise)
    members = []
    for name, values in (("stimulation_delay", [20.0]), ("leak", [1e-6])):
        effects = EffectSet(TANKS, [next(c for c in candidates if c.card.id == name)], ("h1", "h2"))
        low, high = effects.bounds()
        members.append(Explanation(name, effects.model, np.array(values), low, high, np.full(2, level)))

    found = plan(members, data)

    assert found is not None
    assert found.experiment.name != "repeat"


def test_silent_muscle_is_switched_on_beside_what_the_first_trial_did() -> None:
    """Where all inputs driven alike would lead away from what was recorded, the others do what is known to be safe."""
    variables = [Variable("alpha_1", "1"), Variable("alpha_2", "1")]
    inputs = np.column_stack([0.3 + 0.2 * np.sin(TIME), np.zeros(len(TIME))])
    trial = SmoothedTrial(TIME, inputs, np.sin(TIME)[:, None], NOISE)

    found = [e for e in menu(variables, [trial]) if e.name.startswith("first trial")]

    assert len(found) == 3
    for experiment in found:
        np.testing.assert_allclose(experiment.inputs[:, 0], inputs[:, 0], atol=1e-12)
        assert "switch on alpha_2" in experiment.do
    low, high = inputs[:, 0].min(), inputs[:, 0].max()
    peaks = [experiment.inputs[:, 1].max() for experiment in found]
    np.testing.assert_allclose(peaks, low + np.array([0.5, 0.2, 0.05]) * (high - low))


def test_the_model_as_given_is_told_from_an_effect_though_the_effect_can_be_none() -> None:
    system = DRIVE.compile()
    model, none = model_of(DRIVE, system), np.zeros(0)
    members = [
        Explanation("nothing added", model, none, none, none, explanation("viscous_friction", [0.05]).start),
        explanation("viscous_friction", [0.05]),
    ]

    found = plan(members, learning(0.05 * np.sin(2 * TIME)))

    assert found is not None
    assert found.probability > 0.99
    assert found.to_json()["do"] == found.experiment.do


def test_pump_that_only_ran_evenly_is_driven_about_that_flow() -> None:
    """Driven about none instead, a tank that a steady flow keeps half full runs dry."""
    steady, most = 9e-5, 3e-5
    inputs = np.column_stack([np.full(len(TIME), steady), np.zeros((len(TIME), 2))])
    trial = SmoothedTrial(TIME, inputs, np.full((len(TIME), 2), 0.16), np.array([1e-3, 1e-3]))

    for experiment in menu(TANKS.compile().inputs, [trial], {0: most})[1:]:
        assert np.ptp(experiment.inputs[:, 0]) > 0
        assert experiment.inputs[:, 0].min() >= 0.0  # a pump may not turn back
        further = "times the range" in experiment.name
        assert further or np.all(np.abs(experiment.inputs[:, 0] - steady) <= most * (1 + 1e-9))


def test_muscles_that_were_never_stimulated_are_driven_no_further_than_the_model_lets_them() -> None:
    variables = [Variable(f"alpha_{k}", "1", minimum=0.0, maximum=1.0) for k in (1, 2)]
    trial = SmoothedTrial(TIME, np.zeros((len(TIME), 2)), np.zeros((len(TIME), 1)), np.array([1e-3]))

    found = menu(variables, [trial], {0: 0.05, 1: 0.05})[1:]

    assert all(e.inputs.min() >= 0.0 and e.inputs.max() <= 1.0 for e in found)
    assert max(e.inputs.max() for e in found) == pytest.approx(1.0)
    # 100 and 30 times as much are both cut to 1; what 10 times lets them is half of it.
    assert {e.name.partition(", ")[2] for e in found if e.inputs.max() > 0.9} == {"100 times the range"}
    assert all("as far as the model lets them" in e.do for e in found)


def test_wheel_that_only_coasted_is_driven_further_by_fast_torques_than_by_slow_ones() -> None:
    """A tenth of a second of a torque moves it a hundredth of what a second does: far less would hardly show a friction."""
    members = [explanation("viscous_friction", [0.02]), explanation("coulomb_friction", [0.02])]
    data = learning(np.zeros(len(TIME)))

    found = plan(members, data)

    assert found is not None
    slowly = next_experiment._amplitude(members[0], 0, data)
    assert np.abs(found.experiment.inputs[:, 0]).max() > 2 * slowly


def test_experiment_for_a_machine_that_only_rested_tells_all_effects_apart_that_it_may_have() -> None:
    """Steps for an offset and a scale tell a delay from a lag badly; a torque that moves it would have shown at rest."""
    time, system = np.arange(300.0), TANKS.compile()
    level = (1e-4 / 5e-5) ** 2 / (2 * 9.81)
    inputs = np.column_stack([np.full(300, 1e-4), np.zeros((300, len(system.inputs) - 1))])
    data = LearningData((SmoothedTrial(time, inputs, np.full((300, 2), level), np.full(2, 1e-4)),), np.full(2, 1e-4))
    candidates = {c.card.id: c for c in find_candidates(TANKS, system, effect_library())[0]}
    seen = ["joint_offset", "joint_scale", "outlet_error", "saturation", "sensor_lag", "stimulation_delay"]
    hidden = unseen([candidates[name] for name in ("leak", *seen)], [c.site for c in candidates.values()], resting=True)
    effects = [EffectSet(TANKS, [c], ("h1", "h2")) for c in hidden]
    nominal = model_of(TANKS, system).restricted(("h1", "h2"))

    members = remaining(None, [], (), nominal, data, effects)
    found = plan(members, data)

    assert found is not None
    assert {m.label for m in members} == {"nothing added", "leak", *seen} - {"saturation"}
    assert len(found.members) == 5
    assert {"sensor_lag", "stimulation_delay"} <= set(found.members)
    assert found.probability > 0.99


def test_all_members_of_a_class_of_four_are_told_apart() -> None:
    """A torque that never reverses the motion tells drag from friction, and a constant force from no friction at all."""
    sizes = {"viscous_friction": 0.02, "quadratic_drag": 0.005, "constant_force": -0.02, "coulomb_friction": 0.02}
    members = [explanation(effect, [size]) for effect, size in sizes.items()]

    found = plan(members, learning(np.zeros(len(TIME))))

    assert found is not None
    assert found.members == tuple(sizes)
    assert found.alike == ()
    assert found.separation > 10 * found.repeat[0]


def test_what_start_values_and_a_clock_imitate_is_no_separation() -> None:
    """Along a torque a delay moves the speed at the start, and most of the rest is a shift of the clock."""
    torque = 0.05 * np.sin(3 * TIME) + 0.03 * np.cos(20 * TIME)
    members = [explanation("stimulation_delay", [0.02]), explanation("sensor_lag", [0.02])]
    trial = learning(torque).trials[0]

    found = plan(members, LearningData((trial,), NOISE, nuisances=Nuisances(shift_std=0.005)))

    assert found is not None
    assert found.separation < 0.05
    run = found.experiment
    late = [
        m.model.compiled.run(run.time, run.inputs, m.model.compiled.with_values(m.values), m.start) for m in members
    ]
    assert np.mean((late[0].outputs - late[1].outputs) ** 2) / NOISE[0] ** 2 > 10


def test_law_that_holds_a_simpler_one_is_told_from_it_by_what_it_has_beyond() -> None:
    """Refitted, it is the simpler law: only that one can fail to imitate it."""
    simple, larger = explanation("coulomb_friction", [0.02]), explanation("stribeck_friction", [0.02, 0.01, 0.2])
    data = learning(0.05 * np.sin(2 * TIME))

    blind, found = plan([simple, larger], data), plan([simple, replace(larger, simpler="coulomb_friction")], data)

    assert blind is not None and found is not None
    assert blind.to_json()["do"] == INSEPARABLE
    assert found.probability > 0.99


def test_torque_to_both_sides_stays_about_none_at_any_share() -> None:
    """A wheel that nothing holds runs away under half of a torque that is always negative."""
    shares = {"half the range": 0.5, "a fifth of the range": 0.2, "a twentieth of the range": 0.05}

    found = menu(DRIVE.compile().inputs, learning(0.05 * np.sin(2 * TIME)).trials)

    for experiment in found:
        for words, share in shares.items():
            if experiment.name.endswith(words):
                assert np.abs(experiment.inputs[:, 0]).max() <= 0.05 * share * (1 + 1e-9)
    assert sum(experiment.name.endswith("fifth of the range") for experiment in found) > 5


def test_few_records_are_advised_where_one_hardly_decides() -> None:
    members = [explanation("viscous_friction", [0.05]), explanation("coulomb_friction", [0.02])]
    data = learning(0.05 * np.sin(2 * TIME))
    sure = plan(members, data)
    assert sure is not None

    noisy = plan(
        members, data, len(TIME) * sure.separation / 4.0
    )  # the record is worth four, the odds ask for twice three

    assert noisy is not None
    assert noisy.probability < HOPELESS
    assert noisy.to_json()["do"].endswith("one such record will hardly tell them apart, 5 of them will")


def test_second_effect_of_one_kind_is_an_explanation_beside_the_one_that_it_stands_for() -> None:
    """Leaks of both tanks, or one of them and an outlet that is too wide: there was nothing to plan for."""
    candidates = find_candidates(TANKS, TANKS.compile(), effect_library())[0]
    leaks, outlets = ([c for c in candidates if c.card.id == name] for name in ("leak", "outlet_error"))
    fitted = Fit(np.ones(2), np.ones(2), (np.full(2, 0.2),), 1.0, np.zeros(2, bool), 600, correlation=np.eye(2))
    sets = ([leaks[0], outlets[1]], leaks, outlets)
    refits = [Refit(EffectSet(TANKS, chosen, ("h1", "h2")), cast(Any, None), (), fitted, 1) for chosen in sets]

    found = remaining(refits[0], refits, [("outlet_error", "leak")], cast(Any, None), cast(Any, None))

    assert [e.label for e in found] == ["leak + outlet_error", "leak + leak"]
