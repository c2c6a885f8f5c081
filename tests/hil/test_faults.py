"""Faults of every class in every phase: named, bounded in time, and never a torque beyond its limit."""

import os
from pathlib import Path

import numpy as np
import pytest

from hil.codecs.barrett.identifiers import Group, Node, answer_of
from hil.codecs.barrett.properties import decode_value
from hil.codecs.barrett.torques import unpack_torques
from hil.codecs.frame import Frame, Timed
from hil.robots import proficio
from hil.safety.cycle import Reaction
from tests.hil.bench import Bench
from tests.hil.fault_classes import CLASSES
from tests.hil.fault_matrix import PHASES, QUICK, outcome_of, table

DOCUMENT = Path(__file__).parents[2] / "docs" / "fault_matrix.md"
BY_NAME = {fault.name: fault for fault in CLASSES}
# While the arm runs: what must come of a fault, within how many cycles, and a word of the reason.
RUNNING = {
    "one answer lost": (Reaction.REDUCE, 1, "no believable position"),
    "three answers of a motor lost": (Reaction.COMPLY, 3, "for 6 ms"),
    "all answers lost": (Reaction.RELEASE, 15, "for 30 ms"),
    "a length of 2": (Reaction.RELEASE, 15, "for 30 ms"),
    "the host stands still for 30 ms": (Reaction.RELEASE, 1, "ms between two cycles"),
    "a controller that raises": (Reaction.SUPPORT, 1, "the controller raised ZeroDivisionError"),
    "a controller that asks for NaN": (Reaction.SUPPORT, 1, "is nan N.m"),
    "a controller that asks for -8192 N.m": (Reaction.RELEASE, 10, "safety module"),
    "a controller that takes 5 ms": (Reaction.COMPLY, 15, "took more than half of 2 ms"),
    "the disk is full, and the recorder ends": (Reaction.COMPLY, 1, "can no longer be recorded"),
    "a flipped high bit": (Reaction.REDUCE, 1, "no believable position"),
    "a second node of the same number": (Reaction.RELEASE, 15, "for 30 ms"),
    "a jump of the position": (Reaction.RELEASE, 15, "for 30 ms"),
    "a motor that resets": (Reaction.RELEASE, 15, "for 30 ms"),
    "Idle pressed on the pendant": (Reaction.RELEASE, 10, "idle"),
    "emergency stop pressed": (Reaction.SILENCE, 10, "emergency stop"),
    "the safety module finds a fault": (Reaction.RELEASE, 10, "module"),
    "somebody else's torques": (Reaction.RELEASE, 2, "somebody else"),
    "the force sensor saturates": (Reaction.COMPLY, 2, "at the wrist"),
}
# `MISFIT_FAULT_SEQUENCES=1000 make test` runs as many as the hazards' document counts.
SEQUENCES = int(os.environ.get("MISFIT_FAULT_SEQUENCES", "25"))
# What a session bears: the arm is where it should be in spite of it.
BORNE = {
    *("answers doubled", "a node that babbles", "a frozen encoder"),
    "the wall clock goes back by an hour",
}
# What a bus says as it goes, and so the session.
GONE = {
    "the bus goes off": "could not be sent: bus off",
    "the connection is reset": "the bus broke while receiving: connection reset by peer",
}


@pytest.mark.parametrize("fault", CLASSES, ids=lambda fault: fault.name)
@pytest.mark.parametrize("phase", PHASES)
def test_no_fault_brings_a_torque_beyond_its_limit_or_before_arming(fault, phase: str) -> None:  # type: ignore[no-untyped-def]
    found = outcome_of(fault, phase)
    assert found.largest <= 1.0
    assert not found.energised
    # On a bus that is gone the watchdog has the last word, on a connection of its own (test_processes).
    is_gone = "could not be sent" in found.error or "the bus broke" in found.error
    assert found.last == (0, 0, 0, 0) or found.reaction is Reaction.SILENCE or is_gone


@pytest.mark.parametrize("name", RUNNING)
def test_a_running_arm_reacts_in_time_and_says_why(name: str) -> None:
    reaction, cycles, words = RUNNING[name]
    found = outcome_of(BY_NAME[name], "run")
    assert (found.reaction, found.error) == (reaction, "")
    assert found.cycles <= cycles
    assert words in found.reason


@pytest.mark.parametrize("name", sorted(BORNE))
def test_what_a_session_bears_does_not_stop_it(name: str) -> None:
    assert outcome_of(BY_NAME[name], "run").reaction is Reaction.PASS


@pytest.mark.parametrize("phase", PHASES[:-1])  # while it is let down the arm is too slow to run away
def test_a_reversed_motor_never_moves_freely(phase: str) -> None:
    assert outcome_of(BY_NAME["a motor with its sign reversed"], phase).reaction >= Reaction.COMPLY


@pytest.mark.parametrize("phase", PHASES)
@pytest.mark.parametrize("name", GONE)
def test_a_bus_that_goes_ends_the_session_with_what_it_said(name: str, phase: str) -> None:
    assert GONE[name] in outcome_of(BY_NAME[name], phase).error


def test_every_class_has_an_expected_end() -> None:
    apart = {"a motor with its sign reversed", "answers out of order"}
    assert set(BY_NAME) == set(RUNNING) | BORNE | set(GONE) | apart


def test_the_documented_matrix_is_the_measured_one() -> None:
    assert table() in DOCUMENT.read_text()


def test_random_sequences_of_faults_never_pass_a_limit() -> None:
    random = np.random.default_rng(7)
    for _ in range(SEQUENCES):
        bench = Bench(settings=QUICK)
        pilot = bench.pilot()
        chances = random.dirichlet(np.ones(6)) * random.choice([0.02, 0.2, 0.6])

        def disturb(timed: Timed, chances: np.ndarray = chances) -> list[Timed]:
            at, identifier, data = timed.time_ns, timed.frame.identifier, timed.frame.data
            kind = int(np.searchsorted(np.cumsum(chances), random.random()))
            if kind == 0:
                return []
            if kind == 1:
                return [timed, timed]
            if kind == 2:
                return [Timed(at + int(random.integers(1, 5_000_000)), timed.frame)]
            if kind == 3 and data:
                flipped = bytearray(data)
                flipped[random.integers(len(data))] ^= 1 << int(random.integers(8))
                return [Timed(at, Frame(identifier, bytes(flipped)))]
            if kind == 4:
                return [Timed(at, Frame(identifier, random.bytes(int(random.integers(9)))))]
            if kind == 5:
                return [Timed(at, Frame(int(random.integers(0x800)), data))]
            return [timed]

        bench.faults.towards_host.append(disturb)
        bench.run(pilot, 200)
        limits = np.array([joint.torque for joint in QUICK.limits.joints])
        for timed in bench.torque_frames():
            motors = np.array(unpack_torques(timed.frame.data)[:3]) / proficio.Controller().torque_units
            slack = np.abs(proficio.JOINT_TO_MOTOR).sum(axis=0) / proficio.Controller().torque_units
            assert np.all(np.abs(proficio.joint_torques(motors)) <= limits + slack)


@pytest.mark.parametrize("name", ["MODE", "PEN"])
def test_a_module_that_no_longer_says_all_that_it_watches_lets_the_arm_go(name: str) -> None:
    bench = Bench()
    pilot = bench.pilot()
    number, answer = pilot.robot.module[name], answer_of(Node.SAFETY, Group.PROPERTIES)

    def lost(timed: Timed) -> list[Timed]:
        is_it = timed.frame.identifier == answer and decode_value(timed.frame.data).property == number
        return [] if is_it else [timed]

    bench.run(pilot, 600, lambda cycle: bench.faults.towards_host.append(lost) if cycle == 300 else None)
    assert str(pilot.stopped) == "module_agrees: the safety module does not answer"
    # After a quarter of a second of 2 ms each.
    assert 300 + 120 < bench.cycle < 300 + 135
