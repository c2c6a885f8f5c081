"""Reaching and holding the seven postures before and after learning, with an arm that the model does not know."""

import numpy as np
import pytest

from fmus.errors import MisfitError
from orchestrator.control.arm import MUSCLES, PORTS, POSTURES, arm_component, feedback_at, nominal_limb
from orchestrator.control.hold import Controller
from tests.benchmarks.control.run import PERSON, Task, hold, rounds


@pytest.fixture(scope="module")
def found():
    return rounds(PERSON, 3, task=Task(reach=0.5, hold=0.9, judged=0.2))


def test_learning_takes_nearly_all_of_the_error_away(found):
    assert found[0].error > 0.2  # rad: the nominal model knows nothing of the force at the wrist
    assert found[1].error < 0.1 * found[0].error
    assert found[2].error < 0.005 * found[0].error


def test_all_seven_postures_are_held_at_rest(found):
    assert len(found[2].held) == len(POSTURES) == 7
    for each in found[2].held:
        assert each.error < 2e-3  # rad
        assert each.unrest < 0.02  # rad/s


def test_activations_stay_within_bounds_and_below_what_co_contraction_would_take(found):
    for each in (held for part in found for held in part.held):
        assert each.activations.min() >= 0.0
        assert each.activations.max() <= 1.0
        assert each.effort < 0.1


def test_the_loop_is_stable_with_room_at_every_posture_around_the_arm_as_it_is(found):
    for each in found[2].margins:
        assert each.decay > 1.0  # 1/s
        assert each.modulus > 0.5  # a gain of 2 or a phase of 29 degrees at both joints at once
        assert min(each.phase) > np.radians(45)
        assert each.delay > 0.010  # s, two steps beyond the one there is


def test_the_learned_limb_balances_the_torque_that_the_arm_feels_at_a_posture_in_between():
    task, extra = Task(reach=0.6, hold=0.9), np.array([0.95, 1.4])
    controller = Controller(nominal_limb(), feedback_at(POSTURES[3]), len(MUSCLES))
    before = hold(arm_component(PERSON), PORTS, controller, extra, [extra], task)[0]
    for _ in range(2):
        for each in hold(arm_component(PERSON), PORTS, controller, POSTURES[0], POSTURES, task):
            controller.limb.learn([*each.state[:2], 0.0, 0.0], each.activations, [0.0, 0.0], 0.02)
    after = hold(arm_component(PERSON), PORTS, controller, extra, [extra], task)[0]
    assert after.error < 0.15 * before.error


def test_an_exact_model_holds_without_any_error():
    controller = Controller(nominal_limb(), feedback_at(POSTURES[3]), len(MUSCLES))
    held = hold(arm_component(), PORTS, controller, POSTURES[3], POSTURES[3:4], Task())[0]
    assert held.error < 1e-6


def test_a_task_without_time_to_hold_is_refused():
    controller = Controller(nominal_limb(), np.zeros((2, 4)), len(MUSCLES))
    with pytest.raises(MisfitError, match="expected to hold for longer than is judged"):
        hold(arm_component(), PORTS, controller, POSTURES[0], POSTURES[:1], Task(hold=0.1))
