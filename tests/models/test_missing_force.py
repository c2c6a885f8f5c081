"""The force that was added in secret is found within its stated uncertainty."""

import numpy as np
import pytest

from fmus.catalogue import find_modelica_model
from fmus.errors import MisfitError
from orchestrator.diagnosis.advise.unexplained import _residuals
from orchestrator.gp.covariance import Latent
from orchestrator.gp.kernels import OnInputs, SquaredExponential
from orchestrator.gp.observations import observe
from orchestrator.gp.posterior import condition
from orchestrator.models import missing_force
from orchestrator.models.missing_force import Force, missing_forces
from orchestrator.models.smoothing import SmoothedTrial
from orchestrator.models.symbolic import SymbolicModel

TIME = np.arange(600) * 0.004
NOISE = 2e-4  # rad
START = {"linkage.q[1]": 0.8, "linkage.q[2]": 1.2, "linkage.w[1]": 0.0, "linkage.w[2]": 0.0}
Z90 = 1.6449


@pytest.fixture(scope="module")
def arm() -> SymbolicModel:
    return SymbolicModel("arm", find_modelica_model("arm").compile(), ["q1", "q2"])


def waves(rng: np.random.Generator) -> np.ndarray:
    """A torque (n, 2) in N.m of four waves each."""
    frequency, phase = rng.uniform(1.0, 12.0, (4, 2)), rng.uniform(0.0, 6.0, (4, 2))
    return (rng.normal(0.0, 0.3, (4, 2)) * np.sin(frequency * TIME[:, None, None] + phase)).sum(axis=1)


def measured(arm: SymbolicModel, seed: int, torque: np.ndarray | None = None, force_noise: float = 0.0):
    """A noisy trial of the arm under a secret torque, and that torque."""
    rng = np.random.default_rng(seed)
    alpha = 0.3 + 0.15 * np.sin(2 * np.pi * 0.4 * TIME[:, None] + rng.uniform(0.0, 6.0, 6))
    hidden = waves(rng) if torque is None else torque
    wrist = np.column_stack([3.0 * np.sin(5.0 * TIME), 2.0 * np.cos(4.0 * TIME)])
    motion = arm.simulate(TIME, np.column_stack([alpha, wrist, hidden]), ["q1", "q2"], START)
    seen = wrist + force_noise * rng.normal(size=wrist.shape)
    inputs = np.column_stack([alpha, seen, np.zeros_like(hidden)])
    shaken = np.array([0.0] * 6 + [force_noise] * 2 + [0.0] * 2)
    noisy = motion + NOISE * rng.normal(size=motion.shape)
    return SmoothedTrial(TIME, inputs, noisy, np.full(2, NOISE), shaken), hidden


@pytest.fixture(scope="module")
def found(arm) -> tuple[tuple[Force, ...], list[np.ndarray]]:
    trials, hidden = zip(*(measured(arm, seed) for seed in range(3)), strict=True)
    return missing_forces(arm, trials), list(hidden)


def test_intervals_cover_the_hidden_torque_as_often_as_they_say(found):
    forces, hidden = found
    inside = [np.abs(f.mean - h) < Z90 * f.std for f, h in zip(forces, hidden, strict=True)]
    assert 0.80 <= np.mean(inside) <= 0.97


def test_the_hidden_torque_is_found_to_a_few_percent_of_its_size(found):
    forces, hidden = found
    error = np.sqrt(np.mean([(f.mean - h) ** 2 for f, h in zip(forces, hidden, strict=True)]))
    assert error < 0.05 * np.std(hidden)
    assert forces[0].names == ("q1", "q2")
    assert forces[0].units == ("N.m", "N.m")


def test_a_right_model_lacks_nothing_beyond_the_uncertainty(arm):
    trial, _ = measured(arm, 9, np.zeros((len(TIME), 2)))
    (force,) = missing_forces(arm, [trial])
    assert np.abs(force.mean).max() < 0.02  # N.m, of joint torques of several N.m
    assert (np.abs(force.mean) < Z90 * force.std).mean() > 0.8


def test_noise_of_a_measured_force_makes_the_answer_less_certain_and_stays_covered(arm, found):
    trial, hidden = measured(arm, 5, force_noise=0.5)
    (force,) = missing_forces(arm, [trial])
    assert force.std.mean() > 1.05 * np.mean([each.std for each in found[0]])
    assert (np.abs(force.mean - hidden) < Z90 * force.std).mean() > 0.75


def test_it_agrees_with_the_residual_that_the_diagnosis_smooths(arm, found):
    (force, *_), _ = found
    trial, _ = measured(arm, 0)
    compiled = arm.compiled_residual
    crude = compiled.run(TIME, arm.residual_inputs(trial), compiled.parameters, np.zeros(0)).outputs
    smooth = trial.smoother(crude)[100:-100]
    # The two smooth differently: they agree to a tenth of what there is to find.
    assert np.std(smooth - force.mean[100:-100]) < 0.1 * np.std(force.mean)


def test_states_that_nothing_shows_are_estimated_along(found):
    forces, _ = found
    assert forces[0].states.shape == (len(TIME), 4)
    assert (forces[0].states_std[:, 0] < NOISE).all()


def test_a_model_without_correction_inputs_is_refused():
    model = SymbolicModel("pendulum", find_modelica_model("pendulum").compile(), ["omega"])
    trial = SmoothedTrial(TIME, np.zeros((len(TIME), len(model.inputs))), np.zeros((len(TIME), 1)), np.array([1e-3]))
    with pytest.raises(MisfitError, match="pendulum does not show which force it lacks on omega"):
        missing_forces(model, [trial])


def dragged(arm: SymbolicModel, seed: int) -> SmoothedTrial:
    """A trial of an arm with 0.4 N.m.s/rad more damping at both joints than the model has."""
    trial, _ = measured(arm, seed, np.zeros((len(TIME), 2)))
    names = [v.name for v in arm.system.states]
    start = np.array([START[name] for name in names])
    motion = arm.compiled.run(TIME, trial.inputs, damped(arm, 1.0), start).outputs
    noisy = motion + NOISE * np.random.default_rng(seed).normal(size=motion.shape)
    return SmoothedTrial(TIME, trial.inputs, noisy, trial.noise)


def damped(arm: SymbolicModel, share: float) -> np.ndarray:
    """Parameters of the arm with a share of that damping."""
    names, values = [v.name for v in arm.system.parameters], arm.compiled.parameters.copy()
    values[[names.index(f"linkage.b[{k}]") for k in (1, 2)]] += share * 0.4
    return values


def test_a_drag_that_is_learned_from_corrections_is_the_drag_within_its_interval(arm):
    trials = [dragged(arm, seed) for seed in range(2)]
    forces = missing_forces(arm, trials)
    observations = [
        each
        for k, force in enumerate(forces)
        for each in (
            observe(f"{k} {name}", force.states[::25, 2:], name, force.mean[::25, i], force.std[::25, i])
            for i, name in enumerate(force.names)
        )
    ]
    latents = {
        "q1": Latent(OnInputs((0,), SquaredExponential(1.0, (4.0,)))),
        "q2": Latent(OnInputs((1,), SquaredExponential(1.0, (4.0,)))),
    }
    posterior = condition(latents, observations)
    speeds = np.linspace(-1.0, 1.0, 9)[:, None] * np.ones(2)
    for name in latents:
        mean = posterior.mean(name, speeds)[:, 0]
        assert np.allclose(mean, -0.4 * speeds[:, 0], atol=0.02)


def test_other_parameters_than_the_models_own_are_missing_less(arm):
    """Of the drag that is there the model knows three quarters, then all."""
    trial = dragged(arm, 6)
    some, none = (np.std(missing_forces(arm, [trial], damped(arm, share))[0].mean, axis=0) for share in (0.75, 1.0))
    speed = np.std(np.gradient(trial.values, TIME, axis=0), axis=0)
    assert some == pytest.approx(0.1 * speed, rel=0.1)
    assert np.all(none < 0.3 * some)


def test_a_force_that_cannot_be_told_is_said_in_one_line_and_maps_fall_back_on_differences(arm, monkeypatch):
    def breaks(system, values):
        raise np.linalg.LinAlgError("Singular matrix")

    trial = dragged(arm, 7)
    monkeypatch.setattr(missing_force, "smoothed", breaks)
    with pytest.raises(MisfitError, match="arm: the missing force cannot be told from these trials: Singular matrix"):
        missing_forces(arm, [trial])
    (first, _), _ = _residuals(arm, np.zeros(0), [trial], None)
    compiled = arm.compiled_residual
    crude = compiled.run(TIME, arm.residual_inputs(trial), compiled.parameters, np.zeros(0)).outputs
    assert np.allclose(first.values[0], trial.smoother.thin(crude)[:, 0])


def test_maps_show_a_drag_against_its_speed_as_the_smoother_finds_it(arm):
    """Second differences of the same trial bury it in noise of several times its size."""
    trial = dragged(arm, 8)
    (first, _), _ = _residuals(arm, np.zeros(0), [trial], None)
    speed = trial.smoother.thin(trial.speeds)[:, 0]
    assert np.std(first.values[0] + 0.4 * speed) < 0.1 * np.std(0.4 * speed)
