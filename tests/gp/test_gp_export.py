"""A block as an FMU says what the block says, in other people's importer."""

import numpy as np
import pytest
from click.testing import CliRunner

from fmus.errors import MisfitError
from fmus.validate import validate_fmu
from orchestrator.cli.main import misfit
from orchestrator.cosim import ComponentSpec
from orchestrator.cosim.kinds import open_component
from orchestrator.gp.block import Block, Output, Term
from orchestrator.gp.block_component import GpComponent
from orchestrator.gp.covariance import Latent
from orchestrator.gp.export import block_fmu, block_system
from orchestrator.gp.kernels import (
    Constant,
    Linear,
    Matern32,
    Matern52,
    OnInputs,
    Periodic,
    SquaredExponential,
)
from orchestrator.gp.observations import observe
from orchestrator.gp.posterior import condition
from orchestrator.gp.saved import write_block

NAMES = ["q1", "q2", "alpha"]
OUTPUTS = ["fx", "fy", "tau", "fx_sd", "fy_sd", "tau_sd"]
LATENTS = {
    "statics": Latent(Matern52(2.0, (0.5, 0.7)) + Linear((0.3, 0.2)) + Constant(0.4)),
    "strong": Latent(SquaredExponential(3.0, (0.4, 0.4)) * Periodic(1.1, (2.0, 3.0), (0.9, 1.2))),
    "friction": Latent(OnInputs((1,), Matern32(0.6, (0.8,)))),
    "unseen": Latent(SquaredExponential(0.5, (1.0, 1.0))),
}


@pytest.fixture(scope="module")
def block() -> Block:
    rng = np.random.default_rng(4)
    x, a = rng.normal(size=(12, 2)), rng.uniform(size=12)
    seen = (
        observe("alone", x[:6], "statics", rng.normal(size=(6, 2)), 0.1),
        observe("together", x, {"statics": -1.0, "strong": -a, "friction": 0.5}, rng.normal(size=(12, 2)), 0.2),
    )
    force = (Term("statics", -1.0), Term("strong", -1.0, "alpha"))
    torque = (Term("friction"), Term("unseen", 0.5), Term("friction", 2.0, "alpha"))
    outputs = [Output("fx", "N", force, 0), Output("fy", "N", force, 1), Output("tau", "N.m", torque, 0)]
    return Block(condition(LATENTS, seen), {"q1": "rad", "q2": "rad"}, outputs, seen)


@pytest.fixture(scope="module")
def fmu(block, tmp_path_factory):
    return block_fmu(block, tmp_path_factory.mktemp("fmu") / "learned.fmu")


def points(count: int) -> np.ndarray:
    return np.random.default_rng(5).normal(size=(count, 3))


def expected(block: Block, values: np.ndarray) -> list[float]:
    component = GpComponent(block)
    component.set(NAMES, values)
    return component.get(OUTPUTS)


def test_fmpy_gets_the_numbers_of_the_block(fmu, block, tmp_path):
    import fmpy

    folder = fmpy.extract(str(fmu), str(tmp_path / "unzipped"))
    for values in points(4):
        start = dict(zip(NAMES, values, strict=True))
        found = fmpy.simulate_fmu(folder, start_values=start, stop_time=0.01, output=OUTPUTS)[-1]
        assert [found[name] for name in OUTPUTS] == pytest.approx(expected(block, values), rel=1e-9, abs=1e-12)


def test_a_component_of_the_fmu_has_the_slopes_and_units_of_the_block(fmu, block, tmp_path):
    ours = GpComponent(block)
    theirs = open_component(ComponentSpec("learned", "fmu", str(fmu)), tmp_path)
    seed = [0.7, -0.4, 0.2]
    theirs.initialise(0.0, 1.0, None)
    theirs.set(NAMES, [0.3, -0.2, 0.6])
    theirs.start()
    ours.set(NAMES, [0.3, -0.2, 0.6])
    assert theirs.get(OUTPUTS) == pytest.approx(ours.get(OUTPUTS), rel=1e-9)
    found = theirs.derivative(OUTPUTS, NAMES, seed)
    assert found == pytest.approx(ours.derivative(OUTPUTS, NAMES, seed), rel=1e-8)
    units = {port.name: port.unit for port in theirs.ports}
    assert {port.name: units[port.name] for port in ours.ports} == {port.name: port.unit for port in ours.ports}
    theirs.terminate()


def test_nothing_is_to_be_found_in_the_fmu(fmu):
    assert validate_fmu(fmu) == []


def test_a_prior_mean_cannot_be_exported():
    latents = {"f": Latent(SquaredExponential(1.0, (1.0,)), lambda x: x)}
    seen = (observe("d", [[1.0]], "f", [1.0], 0.1),)
    block = Block(condition(latents, seen), {"x": ""}, [Output("y", "", (Term("f"),))], seen)
    with pytest.raises(MisfitError, match="f has a prior mean that is no formula"):
        block_system(block, "b")


def test_a_saved_block_is_built_by_the_command(tmp_path):
    seen = (observe("d", [[0.0], [1.0]], "f", [1.0, 2.0], 0.1),)
    latents = {"f": Latent(SquaredExponential(1.0, (1.0,)))}
    small = Block(condition(latents, seen), {"x": "rad"}, [Output("y", "N", (Term("f"),))], seen)
    path = write_block(small, tmp_path / "small.json")
    done = CliRunner().invoke(misfit, ["build", str(path), "--out", str(tmp_path / "out")])
    assert done.exit_code == 0, done.output
    assert sorted(p.name for p in (tmp_path / "out").iterdir()) == ["small.fmi3.fmu", "small.fmu"]
    third = open_component(ComponentSpec("small", "fmu", str(tmp_path / "out" / "small.fmi3.fmu")), tmp_path)
    third.initialise(0.0, 1.0, None)
    third.set(["x"], [0.4])
    third.start()
    assert third.get(["y"])[0] == pytest.approx(small.mean(small.outputs[0], {"x": 0.4}), rel=1e-9)
    third.terminate()


def test_two_blocks_of_one_name_are_refused(tmp_path):
    done = CliRunner().invoke(misfit, ["build", "a/x.json", "b/x.json", "--out", str(tmp_path)])
    assert isinstance(done.exception, MisfitError) or done.exit_code == 2
    assert "a/x.json and b/x.json both build x.fmu" in f"{done.output}{done.exception}"
