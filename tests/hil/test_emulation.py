"""The emulated arm: its muscles, its dynamics, how it lies on the robot, and what shows that the model is wrong."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.linalg import expm

from fmus.errors import MisfitError
from hil.emulation.anatomy import anatomy
from hil.emulation.corrections import Corrections
from hil.emulation.muscles import Muscles
from hil.emulation.planar import Placement
from hil.emulation.residual import UNKNOWN_SPEED, Residual
from hil.emulation.settings import Learning
from hil.robots import proficio
from hil.virtual.arm_plant import ArmPlant
from hil.virtual.caregiver import Caregiver, Person
from orchestrator.models.kalman import LinearSystem, smoothed
from tests.hil.trial_session import FRICTION, HIDDEN

ANGLE = st.floats(-3.0, 3.0)
PAIR = st.tuples(ANGLE, ANGLE).map(np.array)


def force_of(muscle: dict[str, float], alpha: float, length: float, speed: float) -> float:
    """The muscle's law written out again: alpha Fmax fL gV + Kp max(0, Lf - Lopt)^2."""
    fibre = length - muscle["Lslack"]
    bell = np.exp(-(((fibre - muscle["Lopt"]) / (0.65 * muscle["Lopt"])) ** 2))
    fastest = muscle["Vmax"]
    if speed <= 0:
        gain = max((fastest + speed) / (fastest - speed / 0.25), 0.0)
    else:
        corner = fastest * 0.25 * 0.5 / 1.25
        gain = (1.5 * speed + corner) / (speed + corner)
    return alpha * muscle["Fmax"] * bell * gain + muscle["Kp"] * max(0.0, fibre - muscle["Lopt"]) ** 2


@pytest.mark.parametrize("seed", range(5))
def test_the_muscles_of_the_loop_follow_the_law_of_the_study(seed: int) -> None:
    random, body = np.random.default_rng(seed), anatomy()
    alpha, q, w = random.uniform(0, 1, 6), random.uniform(0.3, 1.6, 2), random.uniform(-1, 1, 2)
    expected = np.zeros(2)
    for k, muscle in enumerate(body.muscles):
        length = body.at_zero[k] - body.arms[0, k] * q[0] - body.arms[1, k] * q[1]
        speed = -body.arms[0, k] * w[0] - body.arms[1, k] * w[1]
        expected += body.arms[:, k] * force_of(dict(muscle), alpha[k], length, speed)
    assert Muscles(body).torques(alpha, q, w) == pytest.approx(expected, rel=1e-9)


@given(PAIR, PAIR)
def test_the_mass_matrix_gives_the_energy_of_two_moving_links(q: np.ndarray, w: np.ndarray) -> None:
    body = anatomy()
    first = body.centre[0] * w[0] * np.array([-np.sin(q[0]), np.cos(q[0])])
    elbow = body.length[0] * w[0] * np.array([-np.sin(q[0]), np.cos(q[0])])
    second = elbow + body.centre[1] * w.sum() * np.array([-np.sin(q.sum()), np.cos(q.sum())])
    energy = 0.5 * (body.mass[0] * first @ first + body.mass[1] * second @ second)
    energy += 0.5 * (body.inertia[0] * w[0] ** 2 + body.inertia[1] * w.sum() ** 2)
    assert 0.5 * w @ body.mass_matrix(q) @ w == pytest.approx(energy, rel=1e-9, abs=1e-12)


@given(PAIR, PAIR)
def test_momentum_changes_by_the_slope_of_the_energy(q: np.ndarray, w: np.ndarray) -> None:
    body, h = anatomy(), 1e-6
    slope = [0.5 * w @ (body.mass_matrix(q + h * e) - body.mass_matrix(q - h * e)) @ w / (2 * h) for e in np.eye(2)]
    assert body.momentum_rate(q, w) == pytest.approx(slope, abs=1e-6)


@pytest.mark.parametrize("side", ["left", "right"])
@given(arm=PAIR, torque=PAIR)
def test_power_and_angles_are_the_same_on_arm_and_robot(side, arm: np.ndarray, torque: np.ndarray) -> None:  # type: ignore[no-untyped-def]
    placement = Placement(side)
    robot = placement.robot_angles(arm)
    assert placement.angles(robot) == pytest.approx(arm)
    speeds = np.array([0.0, 0.3, -0.7])
    power = placement.robot_torques(torque) @ speeds
    assert power == pytest.approx(torque @ placement.speeds(speeds))


@given(PAIR, PAIR)
def test_a_force_comes_back_from_the_sensor(force: np.ndarray, arm: np.ndarray) -> None:
    placement = Placement()
    assert placement.world_force(placement.sensor_force(force, arm), arm) == pytest.approx(force, abs=1e-12)


def test_a_pull_along_a_straight_forearm_is_along_x_of_the_sensor() -> None:
    shown = Placement().sensor_force(np.array([0.0, 5.0]), np.array([np.pi / 2, 0.0]))
    assert shown == pytest.approx([5.0, 0.0, 0.0], abs=1e-12)


@pytest.fixture(scope="module")
def hidden(tmp_path_factory: pytest.TempPathFactory) -> str:
    path = tmp_path_factory.mktemp("body") / "HiddenFriction.mo"
    path.write_text(HIDDEN)
    return f"{path}:HiddenFriction"


def pushed(model: str, seconds: float = 1.0):  # type: ignore[no-untyped-def]
    """Angles, speeds and torques of a plant that is pushed to and fro, every 2 ms."""
    plant = ArmPlant(np.array([0.0, 0.0, 1.3]), Placement(), model)
    for k in range(int(seconds / 0.002)):
        torque = np.array([0.4 * np.sin(0.02 * k), 0.3 * np.cos(0.017 * k)])
        plant.step(Placement().robot_torques(torque), 0.002)
        yield Placement().angles(plant.angles), Placement().speeds(plant.speeds), torque


def step_of(k: int) -> float:
    return 0.002 if k else 0.0


STILL = np.zeros(2)
# Encoders and forces of a simulation have no noise but that of rounding.
EXACT = Learning(encoder=1e-6, sensor=1e-3, noise=0.01)


def test_the_residual_of_the_nominal_arm_is_none() -> None:
    residual = Residual(anatomy(), EXACT)
    found = [residual.advance(q, w, tau, STILL, step_of(k)) for k, (q, w, tau) in enumerate(pushed("arm"))]
    assert np.max(np.abs(found)) < 5e-3


def test_the_residual_of_hidden_friction_is_the_friction(hidden: str) -> None:
    residual, found, expected = Residual(anatomy(), EXACT), [], []
    for k, (q, w, tau) in enumerate(pushed(hidden)):
        found.append(residual.advance(q, w, tau, STILL, step_of(k)))
        expected.append([0.0, -FRICTION * w[1]])
    assert np.ptp(expected) > 0.1
    assert np.array(found)[20:] == pytest.approx(np.array(expected)[20:], abs=5e-3)
    assert residual.speeds == pytest.approx(w, abs=1e-3)


def test_a_moment_is_known_better_a_window_later_and_as_well_as_is_said(hidden: str) -> None:
    learning = Learning(encoder=2e-4, sensor=1e-3)
    random, residual, errors = np.random.default_rng(5), Residual(anatomy(), learning), []
    before: tuple[np.ndarray, ...] = ()
    for k, (q, w, tau) in enumerate(pushed(hidden, 8.0)):
        residual.advance(q + learning.encoder * random.normal(size=2), w, tau, STILL, step_of(k))
        truth = np.array([0.0, -FRICTION * w[1]])
        if k % 50 == 1:
            if before:
                marked, at_once, sure_at_once = before
                torque, deviation = residual.marked
                errors.append([torque - marked, deviation, at_once - marked, sure_at_once])
            residual.mark()
            before = truth, residual.torque, residual.deviation
    later, said, early, said_early = np.swapaxes(errors, 0, 1)
    assert np.mean(np.abs(later) < 2.6 * said) > 0.95  # 99 % by the normal distribution
    assert np.all(said < 0.75 * said_early)
    assert np.sqrt(np.mean(later**2)) < 0.75 * np.sqrt(np.mean(early**2))


def test_marked_torques_are_those_of_a_smoother_over_the_whole_record() -> None:
    """For links whose equations are linear: without centre of mass of the outer one, and without damping."""
    body = replace(anatomy(), centre=np.array([anatomy().centre[0], 0.0]), damping=STILL)
    learning, steps, at, step = Learning(encoder=1e-4), 60, 25, 0.002
    random = np.random.default_rng(2)
    measured = np.array([0.5, 1.0]) + 1e-3 * np.cumsum(random.normal(size=(steps, 2)), axis=0)
    torques = random.normal(size=(steps, 2))
    residual = Residual(body, learning)
    for k in range(steps):
        residual.advance(measured[k], STILL, torques[k], STILL, step if k else 0.0)
        if k == at:
            residual.mark()

    inverse, size, rate = np.linalg.inv(body.mass_matrix(STILL)), learning.deviation, np.sqrt(3) / learning.duration
    both, none = np.eye(2), np.zeros((2, 2))
    flow = np.block([[none, inverse, none, none], [none, none, both, none], [none, none, none, both], [none] * 4])
    move = np.eye(8) + step * flow + 0.5 * step**2 * flow @ flow
    process = expm(step * np.array([[0.0, 1.0], [-(rate**2), -2 * rate]]))
    move[4:, 4:] = np.kron(process, both)
    lasting = np.diag([size**2, (rate * size) ** 2])
    new = np.zeros((8, 8))
    new[4:, 4:] = np.kron(lasting - process @ lasting @ process.T, both)
    pulls = [body.jacobian(q).T for q in measured[1:]]
    disturbances = np.tile(new, (steps - 1, 1, 1))
    disturbances[:, 2:4, 2:4] += [(learning.sensor * step) ** 2 * pull @ pull.T for pull in pulls]
    pushes = np.concatenate([0.5 * step**2 * torques @ inverse, step * torques, np.zeros((steps, 4))], axis=1)
    mass, vague = body.mass_matrix(STILL), 1e3 * learning.encoder
    start = np.zeros((8, 8))
    start[:2, :2], start[2:4, 2:4] = vague**2 * both, UNKNOWN_SPEED**2 * mass @ mass
    start[4:, 4:] = np.kron(lasting, both)
    system = LinearSystem(
        np.tile(move, (steps - 1, 1, 1)),
        pushes[1:],
        disturbances,
        np.tile(np.eye(2, 8), (steps, 1, 1)),
        np.zeros((steps, 2)),
        np.full(2, learning.encoder**2),
        np.concatenate([measured[0], np.zeros(6)]),
        start,
    )
    found = smoothed(system, measured)

    torque, deviation = residual.marked
    assert torque == pytest.approx(found.means[at, 4:6], rel=1e-4, abs=1e-5)
    assert deviation == pytest.approx(np.sqrt(np.diag(found.covariances[at])[4:6]), rel=1e-4)
    assert residual.torque == pytest.approx(found.means[-1, 4:6], rel=1e-4, abs=1e-5)


def test_an_angle_that_was_not_measured_is_not_believed(hidden: str) -> None:
    errors = {}
    for told in (True, False):
        residual, worst, last = Residual(anatomy(), EXACT), 0.0, STILL
        for k, (q, w, tau) in enumerate(pushed(hidden)):
            lost = k % 40 == 39
            seen = last if lost else q
            found = residual.advance(seen, w, tau, STILL, step_of(k), fresh=not (lost and told))
            last = q
            worst = max(worst, float(np.abs(found - [0.0, -FRICTION * w[1]]).max())) if k > 20 else 0.0
        errors[told] = worst
    assert errors[True] < 0.01
    assert errors[False] > 10 * errors[True]


def test_after_a_gap_the_residual_begins_anew() -> None:
    residual = Residual(anatomy(), EXACT)
    for k, (q, w, tau) in enumerate(pushed("arm", 0.1)):
        residual.advance(q, w, tau, STILL, step_of(k))
    known = residual.deviation.copy()
    residual.advance(q + 0.3, w, tau, STILL, 1.0)
    assert np.all(residual.deviation > known)
    assert residual.torque.tolist() == [0.0, 0.0]


def learned(model: str, seconds: float, learning: Learning, interrupted: int = 0) -> Corrections:
    """What is learned of a plant that is pushed, with an interruption each so many cycles."""
    residual, corrections = Residual(anatomy(), learning), Corrections(learning)
    for k, (q, w, tau) in enumerate(pushed(model, seconds)):
        residual.advance(q, w, tau, STILL, step_of(k))
        corrections.advance(residual, q, step_of(k), learn=not interrupted or k % interrupted != 0)
    return corrections


def test_what_is_learned_of_hidden_friction_opposes_the_speed(hidden: str) -> None:
    corrections = learned(hidden, 4.0, replace(EXACT, noise=0.02))
    assert (
        corrections.moments == 39
    )  # the first cycle marks the first moment, the window after the last one is not over
    for q, w, _ in pushed(hidden, 2.0):
        missing = corrections.predict(q, w)
    assert missing == pytest.approx([0.0, -FRICTION * w[1]], abs=0.03)
    assert corrections.uncertainty(q, w) < 0.2 * corrections.uncertainty(q, w + 5.0)


def test_nothing_is_learned_of_interrupted_windows(hidden: str) -> None:
    corrections = learned(hidden, 1.0, Learning(), interrupted=40)
    assert corrections.count == 0
    assert corrections.predict(STILL, STILL).tolist() == [0.0, 0.0]
    assert corrections.uncertainty(STILL, STILL) == Learning().deviation


def test_no_more_data_are_kept_than_the_budget() -> None:
    corrections = learned("arm", 1.0, Learning(budget=5))
    assert corrections.moments > 5
    assert corrections.count == 5


@pytest.mark.parametrize(
    "wrong",
    [{"budget": 0}, {"noise": -1.0}, {"share": 1.5}, {"duration": 0.0}, {"encoder": -1e-4}, {"window_s": float("nan")}],
)
def test_learning_that_cannot_be_is_refused_by_name(wrong: dict) -> None:
    with pytest.raises(MisfitError, match=f"learning: {next(iter(wrong))} = "):
        Learning(**wrong)


# --- the virtual caregiver

AWAY = np.array([0.05, 0.0])


def gripped(person: Person) -> Caregiver:
    caregiver = Caregiver(person)
    caregiver.hold()
    caregiver.advance(STILL, STILL, person.grip_s)
    return caregiver


def felt(caregiver: Caregiver, position: np.ndarray, velocity: np.ndarray, seconds: float) -> np.ndarray:
    """The force (2,) in N after a time at one place."""
    caregiver.advance(position, velocity, seconds)
    return caregiver.force(position, velocity)


def test_a_caregiver_who_was_not_told_to_hold_does_not_push() -> None:
    assert felt(Caregiver(), AWAY, np.ones(2), 1.0).tolist() == [0.0, 0.0]


def test_a_grip_is_a_spring_and_a_damper_until_the_person_reacts() -> None:
    person = Person(stiffness=500.0, damping=20.0, reaction_s=0.2)
    caregiver = gripped(person)
    for _ in range(38):
        force = felt(caregiver, AWAY, np.array([0.1, 0.2]), 0.005)
    assert force == pytest.approx([-500.0 * 0.05 - 2.0, -4.0])


def test_a_person_pushes_harder_against_what_stays_away() -> None:
    person = Person(stiffness=500.0, effort=300.0, brake=0.0, lag_s=0.01)
    caregiver = gripped(person)
    for _ in range(int(1.2 / 0.005)):
        force = felt(caregiver, AWAY, STILL, 0.005)
    # The integral of 5 cm over the time since the reaction began, one second; the lag takes a hundredth of it.
    assert force[0] == pytest.approx(-500 * 0.05 - 300 * 0.05 * 1.0, rel=0.02)


def test_nobody_is_stronger_than_he_is() -> None:
    force = felt(gripped(Person(strength=60.0)), np.array([3.0, -4.0]), STILL, 0.005)
    assert np.hypot(*force) == pytest.approx(60.0)
    assert force == pytest.approx([-36.0, 48.0])


def test_letting_go_takes_its_time_and_ends_without_force() -> None:
    caregiver = gripped(Person(grip_s=0.3))
    caregiver.relax()
    forces = [abs(felt(caregiver, AWAY, STILL, 0.03)[0]) for _ in range(12)]
    assert forces == sorted(forces, reverse=True)
    assert forces[-1] == 0.0


def test_the_force_that_a_plant_shows_is_no_false_friction() -> None:
    """A damped arm in a grip: its momentum changes by what it shows (a spring of 900 N/m that lags 0.5 ms is 0.1 N.m.s/rad)."""
    plant, body = ArmPlant(proficio.HOME["right"], Placement()), anatomy()
    plant.caregiver.hold()
    step, rows = 0.001, []
    for k in range(1500):
        torque = np.array([0.0, 2.0, 1.0]) * np.sin(12.0 * k * step)
        plant.step(torque, step)
        q, w = Placement().angles(plant.angles), Placement().speeds(plant.speeds)
        pull = body.jacobian(q).T @ Placement().world_force(plant.force, q)
        rows.append((body.mass_matrix(q) @ w, w, pull, torque[1:], body.expected_rate(q, w, np.zeros(2))))
    plant.close()
    momentum, w, pull, torque, alone = (np.array(part)[400:] for part in zip(*rows, strict=True))
    middle = [0.5 * (each[1:] + each[:-1]) for each in (pull, alone, w)]
    missing = np.diff(momentum, axis=0) / step - middle[0] - middle[1] - torque[1:]
    friction = -np.sum(missing * middle[2], axis=0) / np.sum(np.square(middle[2]), axis=0)
    assert friction == pytest.approx([0.0, 0.0], abs=0.01)
