"""Prior means from a physics model, against running that model."""

import numpy as np
import pytest

from fmus.catalogue import find_modelica_model
from fmus.errors import MisfitError
from orchestrator.gp.block import Block, Output, Term
from orchestrator.gp.covariance import Latent
from orchestrator.gp.export import block_system
from orchestrator.gp.kernels import SquaredExponential
from orchestrator.gp.observations import observe
from orchestrator.gp.physics import prior_means, prior_means_of
from orchestrator.gp.posterior import condition
from orchestrator.gp.saved import read_block, write_block
from orchestrator.models.symbolic import SymbolicModel

STATES = ("linkage.q[1]", "linkage.q[2]", "linkage.w[1]", "linkage.w[2]")
TORQUES = ("tauMuscle[1]", "tauMuscle[2]")
ACTIVATIONS = tuple(f"alpha_{k}" for k in range(1, 7))
POINTS = np.random.default_rng(0).uniform([0.2, 0.8, -1, -1], [1.2, 1.8, 1, 1], size=(5, 4))


@pytest.fixture(scope="module")
def system():
    return find_modelica_model("arm").compile()


@pytest.fixture(scope="module")
def means(system):
    return prior_means(system, TORQUES, STATES, ACTIVATIONS)


def test_statics_and_capabilities_add_up_to_the_torque_that_the_model_simulates(system, means):
    statics, muscles = means
    alpha = np.random.default_rng(1).uniform(size=6)
    inputs = np.tile([*alpha, 0.0, 0.0, 0.0, 0.0], (2, 1))
    model = SymbolicModel("arm", system, TORQUES)
    for point in POINTS:
        start = dict(zip(STATES, point, strict=True))
        torque = model.simulate(np.array([0.0, 1e-4]), inputs, TORQUES, start)[0]
        parts = [
            statics.mean(point[None])[0],
            *(a * m.mean(point[None])[0] for a, m in zip(alpha, muscles, strict=True)),
        ]
        assert np.sum(parts, axis=0) == pytest.approx(torque, rel=1e-12)


def test_gradients_are_slopes_of_the_means(means):
    step = 1e-6
    for part in (means[0], *means[1]):
        found = part.gradient(POINTS)
        for k in range(4):
            moved = step * np.eye(4)[k]
            slope = (part.mean(POINTS + moved) - part.mean(POINTS - moved)) / (2 * step)
            assert np.allclose(found[:, :, k], slope, rtol=1e-6, atol=1e-7)


def test_without_data_the_posterior_is_the_physics_model_and_far_from_data_it_returns_to_it(means):
    statics, _ = means
    latents = {"statics": Latent(SquaredExponential(1.0, (0.1,) * 4), statics.mean, statics.gradient)}
    seen = observe("d", POINTS[:1], "statics", statics.mean(POINTS[:1]) + 0.5, 0.01)
    found = condition(latents, [seen])
    far = POINTS[:1] + 3.0
    assert np.allclose(found.mean("statics", far), statics.mean(far), rtol=1e-12)
    assert np.allclose(found.mean("statics", POINTS[:1]), statics.mean(POINTS[:1]) + 0.5, atol=1e-3)
    assert np.allclose(found.gradient("statics", far), statics.gradient(far), rtol=1e-9)


def test_a_name_that_the_model_lacks_is_refused(system):
    with pytest.raises(MisfitError, match="Arm has no 'alpha_7'"):
        prior_means(system, TORQUES, STATES, ("alpha_7",))


@pytest.fixture(scope="module")
def block():
    """What is expected of the arm's passive torques, and of its biceps, with a few data beside."""
    rest, (biceps,) = prior_means_of("arm", TORQUES, STATES, ["alpha_3"])
    kernel = SquaredExponential(1.0, (0.5,) * 4)
    latents = {
        "rest": Latent(kernel, rest.mean, rest.gradient),
        "biceps": Latent(kernel, biceps.mean, biceps.gradient),
    }
    seen = observe("d", POINTS, {"rest": 1.0, "biceps": 0.5}, np.ones((5, 2)), 0.05)
    outputs = [Output(f"tau{k + 1}", "N.m", (Term("rest"), Term("biceps", 1.0, "alpha")), k) for k in range(2)]
    inputs = {"q1": "rad", "q2": "rad", "w1": "rad/s", "w2": "rad/s"}
    return Block(condition(latents, [seen]), inputs, outputs, (seen,))


DRIVE = """model Drive "a drive"
  parameter Real d(unit = "N.m.s/rad") = 0.5;
  parameter Real J(unit = "kg.m2") = 1;
  input Real u(unit = "N.m");
  Real w(start = 0, unit = "rad/s");
  output Real tau(unit = "N.m");
equation
  J*der(w) = u - d*w;
  tau = -d*w;
end Drive;
"""
HERE = {"q1": 0.6, "q2": 1.4, "w1": 0.1, "w2": -0.2, "alpha": 0.7}


def test_a_block_with_a_physics_prior_comes_back_from_its_file(block, tmp_path):
    again = read_block(write_block(block, tmp_path / "block.json"))
    for mine, theirs in zip(block.outputs, again.outputs, strict=True):
        assert again.mean(theirs, HERE) == block.mean(mine, HERE)
        assert again.deviation(theirs, HERE) == block.deviation(mine, HERE)


def test_a_block_is_not_read_beside_another_version_of_its_model(tmp_path):
    """Its data are what one version lacks: beside another they mean something else."""
    file = tmp_path / "Drive.mo"
    file.write_text(DRIVE)
    model, kernel = f"{file}:Drive", SquaredExponential(1.0, (0.5,))
    rest, _ = prior_means_of(model, ["tau"], ["w"], [])
    latents = {"rest": Latent(kernel, rest.mean, rest.gradient)}
    seen = observe("d", [0.1, 0.5, 0.9], "rest", [0.3, 0.4, 0.5], 0.05)
    saved = write_block(
        Block(condition(latents, [seen]), {"w": "rad/s"}, [Output("tau", "N.m", (Term("rest"),))], (seen,)),
        tmp_path / "block.json",
    )
    file.write_text(DRIVE.replace('"a drive"', '"the same drive"'))
    read_block(saved)

    file.write_text(DRIVE.replace("= 0.5", "= 0.7"))
    with pytest.raises(MisfitError, match="says something else .off by up to 0.18.: learn the block again"):
        read_block(saved)


def test_a_block_with_a_physics_prior_is_a_formula_that_fmus_can_hold(block):
    system = block_system(block, "arm_and_more")
    point = [HERE[v.name] for v in system.inputs]
    _, found = system.rhs(0, [], point, [], [])
    expected = [block.mean(o, HERE) for o in block.outputs] + [block.deviation(o, HERE) for o in block.outputs]
    assert np.array(found)[:, 0] == pytest.approx(expected, rel=1e-9)


def test_a_prior_mean_that_names_no_model_is_not_saved(means, tmp_path):
    statics, _ = means
    latents = {"rest": Latent(SquaredExponential(1.0, (1.0,) * 4), statics.mean, statics.gradient)}
    seen = observe("d", POINTS, "rest", np.ones((5, 2)), 0.05)
    alone = Block(condition(latents, [seen]), dict.fromkeys("abcd", "1"), [Output("t", "1", (Term("rest"),))], (seen,))
    with pytest.raises(MisfitError, match="rest has a prior mean that names no model"):
        write_block(alone, tmp_path / "block.json")
