"""The truth of the caregivers' study: equations in closed form against the FMUs, and people whose behaviour is known."""

from dataclasses import replace

import numpy as np
import pytest

from orchestrator.cosim import ComponentSpec, System, Value, simulate
from orchestrator.study.corrections import SENSOR_N, Corrections, averaged
from orchestrator.study.design import POSITIONS, Caregiver, Trial, draw_caregivers, draw_trials
from orchestrator.study.muscles import (
    at_wrist,
    capabilities,
    jacobian,
    moving_torques,
    perfect,
    statics,
    torques,
    wrist,
)
from orchestrator.study.regression import errors_at
from orchestrator.study.trials import fmus, run_trial

STEADY = {"share": 1e-9, "rest": 1e-9}


def trial(activation: float = 0.3, position: int = 3) -> Trial:
    return Trial(0, 0, position, np.full(6, activation), np.zeros(2), np.array([1.0, 2.0, 3.0, 9.0]), np.zeros((2, 4)))


def states(count: int) -> np.ndarray:
    rng = np.random.default_rng(5)
    return np.column_stack([rng.uniform([0.0, 0.5], [1.5, 2.2], (count, 2)), rng.uniform(-2.0, 2.0, (count, 2))])


def test_largest_endpoint_forces_agree_with_the_ones_the_paper_states() -> None:
    q1, q2 = np.meshgrid(np.linspace(0.0, 1.5, 13), np.linspace(0.5, 2.2, 15))
    grid = np.column_stack([q1.ravel(), q2.ravel(), np.zeros(q1.size), np.zeros(q1.size)])

    largest = np.linalg.norm(capabilities(grid), axis=2).max(axis=0)

    assert largest[[2, 4]] == pytest.approx([4.0, 7.5], rel=0.25)
    assert np.all((largest[[0, 1, 3, 5]] > 100.0) & (largest[[0, 1, 3, 5]] < 300.0))


def test_jacobian_is_the_derivative_of_the_wrist() -> None:
    q = states(5)[:, :2]
    numeric = np.stack([(wrist(q + step) - wrist(q - step)) / 2e-6 for step in 1e-6 * np.eye(2)], axis=2)

    assert jacobian(q) == pytest.approx(numeric, abs=1e-9)


def test_speeds_change_active_forces_only() -> None:
    moving, still = states(20), states(20) * np.array([1.0, 1.0, 0.0, 0.0])

    assert statics(moving) == pytest.approx(statics(still), rel=1e-14)
    assert not np.allclose(capabilities(moving), capabilities(still))


def test_the_perfect_correction_holds_the_fmu_of_the_arm_where_it_is() -> None:
    activation = np.array([0.5, 0.2, 0.9, 0.1, 0.7, 0.4])
    for posture in POSITIONS[[0, 3, 6]]:
        force = perfect(np.array([[*posture, 0.0, 0.0]]), activation[None])[0]
        values = {"linkage.q[1]": posture[0], "linkage.q[2]": posture[1], "fx": force[0], "fy": force[1]}
        values |= {f"alpha_{k + 1}": number for k, number in enumerate(activation)}
        arm = ComponentSpec("arm", source=fmus()[0], values={name: Value(float(v)) for name, v in values.items()})

        held = simulate(System("held", {"arm": arm}), step=0.01, stop=0.05)

        assert held["arm.q1"][-1] == pytest.approx(posture[0], abs=1e-8)
        assert held["arm.q2"][-1] == pytest.approx(posture[1], abs=1e-8)


def test_equation_of_motion_in_closed_form_is_that_of_the_fmu() -> None:
    """M a + h + b w = tau + J' f at the middle of steps of a quarter of a millisecond, away from the stops."""
    weak = Caregiver(limit=20.0)
    record = run_trial(trial(), weak, step=2.5e-4)[:800]
    middle, before = 0.5 * (record[1:] + record[:-1]), record[:-1]
    state, hand = middle[:, :4], before[:, 4:]
    passive, active = torques(state)
    muscles = passive + 0.3 * active.sum(axis=1)

    wanted = muscles + np.einsum("nij,ni->nj", jacobian(state[:, :2]), hand)
    moved = moving_torques(state, np.diff(record[:, 2:4], axis=0) / 2.5e-4)

    assert np.ptp(record[:, 1]) > 0.3
    assert np.abs(moved - wanted).max() < 2e-3 * np.abs(wanted).max()


def test_a_torque_as_a_force_at_the_wrist_comes_back_as_the_torque() -> None:
    q, torque = states(4)[:, :2], np.arange(8.0).reshape(4, 2)

    assert np.einsum("nij,ni->nj", jacobian(q), at_wrist(q, torque)) == pytest.approx(torque)


def test_a_strong_steady_caregiver_errs_only_by_the_sensor() -> None:
    firm = Caregiver(stiffness=3e4, damping=500.0, adapting=1e4, limit=1e4, **STEADY)
    found = averaged(run_trial(trial(), firm), trial(), seed=1)

    late = found.rows(np.array([1, 2, 3]))
    error = late.force - late.required

    assert np.abs(error).max() < 4.0 * SENSOR_N
    assert not found.at_stop.any()
    assert found.moved.max() < 0.05


def test_a_push_that_is_perfect_has_no_error() -> None:
    found = averaged(run_trial(trial(), Caregiver()), trial(), seed=1)
    ideal = replace(found, force=found.required)

    assert errors_at(ideal, ideal.state).error == pytest.approx(np.zeros(4), abs=1e-12)


def test_error_of_a_caregiver_who_is_too_weak_is_about_what_is_lacking() -> None:
    weak = Caregiver(limit=40.0, **STEADY)
    found = averaged(run_trial(trial(0.6), weak), trial(0.6), seed=1)
    required = np.linalg.norm(found.required, axis=1)
    error = np.linalg.norm(found.force - found.required, axis=1)

    assert found.at_stop[1:].all()
    assert np.linalg.norm(found.force, axis=1).max() < 40.0 + 4.0 * SENSOR_N
    assert (error[1:] > 0.9 * (required[1:] - 40.0)).all()


def test_motion_taken_out_brings_moving_corrections_nearer_to_the_perfect_ones() -> None:
    """In the first half second, while the arm yields; the sensor's noise is the same in both."""
    trials = [trial(0.7, position) for position in (0, 1, 4, 6)]
    first = [averaged(run_trial(each, Caregiver(limit=400.0)), each, seed=1).rows(np.array([0])) for each in trials]

    raw, freed = (sum(float(np.linalg.norm(f - each.required)) for each, f in pairs) for pairs in _pushes(first))

    assert freed < 0.85 * raw


def _pushes(first: list[Corrections]) -> list[list[tuple[Corrections, np.ndarray]]]:
    return [[(each, each.force) for each in first], [(each, each.compensated().force) for each in first]]


def test_a_quarter_of_the_step_changes_corrections_by_less_than_the_sensor_does() -> None:
    coarse, fine = (run_trial(trial(), Caregiver(), step=step) for step in (1e-3, 2.5e-4))

    def means(record: np.ndarray) -> np.ndarray:
        return record[1:].reshape(4, -1, 6).mean(axis=1)

    assert np.abs(means(coarse) - means(fine))[:, 4:].max() < SENSOR_N


def test_all_caregivers_meet_the_same_patterns_and_each_position_three_times() -> None:
    trials = draw_trials(seed=4, caregivers=8)
    by_caregiver = [[each for each in trials if each.caregiver == k] for k in range(8)]

    assert len(trials) == 168
    for mine in by_caregiver:
        assert [each.activation.tolist() for each in mine] == [each.activation.tolist() for each in by_caregiver[0]]
        assert sorted(each.position for each in mine) == sorted(list(range(7)) * 3)
    assert len({tuple(each.position for each in mine) for mine in by_caregiver}) == 8


def test_caregivers_differ_from_each_other_and_come_back_with_the_seed() -> None:
    one, again, other = (draw_caregivers(seed, Caregiver(), 8) for seed in (3, 3, 4))

    assert one == again != other
    for name in ("stiffness", "damping", "reaction", "adapting", "limit"):
        assert len({getattr(person, name) for person in one}) == 8
