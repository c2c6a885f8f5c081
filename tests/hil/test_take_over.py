"""The torque of whoever takes over comes up along the ramp: after arming, after the proof, after a pause, after a swap."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from hil.control.controllers import Observed
from hil.control.pilot import Decision, Pilot
from hil.session.loop import Loop, Wishes
from hil.settings import Settings
from tests.hil.bench import SETTINGS, Bench, ExactTimer

ASKED, RATE = 2.0, 500
# N.m that the torque may grow by in a cycle along a ramp of a second; rounding is left.
STEP = ASKED / RATE * 1.01
QUIET = replace(SETTINGS, limits=replace(SETTINGS.limits, power=1e3, energy=1e3))


class Pushes:
    """Asks for the same torque at the elbow always; the joint is held in place from outside."""

    turn = 0

    def torque(self, observed: Observed) -> np.ndarray:
        return np.array([0.0, 0.0, ASKED])


def passed(
    settings: Settings, cycles: int, change: Callable[[int, Pilot, Pushes], None] = lambda *_: None
) -> np.ndarray:
    """Torque (cycles,) in N.m of the elbow that a session lets pass, with a change at some cycle."""
    bench, pushes, found = Bench(settings=settings), Pushes(), list[float]()
    robot = bench.started()
    bench.plant.angles = np.array([-0.3, 0.2, 1.5])
    bench.plant.damping = 100.0  # whatever it is asked for, it hardly moves
    bench.robot.advance(bench.bus.time_ns)
    pilot = Pilot(robot, settings.limits, pushes, gravity=False, proof=settings.make_proof())

    def wishes() -> Wishes:
        change(len(found), pilot, pushes)
        if pilot.proof is not None and pilot.is_armed and pilot.proof.joint < 0:
            pilot.proof.is_done = len(found) > 0.9 * RATE  # it proves nothing here but takes its time
        return Wishes(arm=not pilot.is_armed, over=len(found) > cycles)

    def watch(start_ns: int, decision: Decision) -> None:
        found.append(decision.passed[2] if pilot.is_armed else 0.0)

    Loop(bench.wire, pilot, ExactTimer(bench), watch=watch).run(wishes)
    bench.wire.close()
    return np.array(found[:cycles])


@pytest.mark.parametrize("proof", [False, True])
def test_torque_comes_up_over_the_ramp_when_a_controller_takes_over(proof: bool) -> None:
    found = passed(replace(QUIET, proof=proof), 3 * RATE)
    assert np.max(np.diff(found)) <= STEP
    assert np.max(found) == pytest.approx(ASKED, rel=1e-3)


def _swap(cycle: int, pilot: Pilot, pushes: Pushes) -> None:
    if cycle == 800:
        pilot.controller = Pushes()


def _resume(cycle: int, pilot: Pilot, pushes: Pushes) -> None:
    if cycle == 800:
        pushes.turn += 1


@pytest.mark.parametrize("change", [_swap, _resume])
def test_a_controller_that_takes_over_from_another_begins_at_the_foot_of_the_ramp(change: Callable) -> None:
    found = passed(QUIET, 3 * RATE, change)
    assert found[795] == pytest.approx(ASKED, rel=1e-3)
    assert found[805] < 10 * STEP
    assert np.max(np.diff(found)) <= STEP
    assert found[-1] == pytest.approx(ASKED, rel=1e-3)
