"""A coupled system with a Gaussian-process block as one FMU: what the block predicts acts inside as it does in the co-simulation."""

from pathlib import Path

import numpy as np
import pytest
from fmpy import simulate_fmu

from fmus.errors import MisfitError
from orchestrator.cosim.container import build_container
from orchestrator.cosim.load import load_system
from orchestrator.cosim.run import simulate
from orchestrator.gp.block import Block, Output, Term
from orchestrator.gp.covariance import Latent
from orchestrator.gp.kernels import OnInputs, SquaredExponential
from orchestrator.gp.observations import observe
from orchestrator.gp.posterior import condition
from orchestrator.gp.saved import write_block

SYSTEM = """
[run]
stop = 0.5
step = 0.001
[components.wheel]                 # dw/dt = 2 torque, from 3 rad/s
kind = "controller"
a = [[0.0]]
b = [[2.0]]
c = [[1.0]]
inputs = { torque = "N.m" }
outputs = { w = "rad/s" }
parameters = { x0 = [3.0] }
[components.friction]
gp = "friction.json"
EXTRA
[[connections]]
from = "wheel.w"
to = "friction.speed"
[[connections]]
from = "friction.torque"
to = "wheel.torque"
"""


def written(folder: Path, extra: str = "") -> Path:
    """The system, with a block that has learned torque = -0.4 w."""
    speed = np.linspace(-4.0, 4.0, 17)[:, None]
    latents = {"f": Latent(OnInputs((0,), SquaredExponential(10.0, (4.0,))))}
    seen = (observe("f", speed, "f", -0.4 * speed[:, 0], 1e-4),)
    block = Block(condition(latents, seen), {"speed": "rad/s"}, [Output("torque", "N.m", (Term("f"),))], seen)
    write_block(block, folder / "friction.json")
    (folder / "wheel.toml").write_text(SYSTEM.replace("EXTRA", extra))
    return folder / "wheel.toml"


def test_block_in_one_fmu_brakes_as_in_the_co_simulation(tmp_path: Path) -> None:
    file = written(tmp_path)
    apart = simulate(load_system(file))

    for fmu in build_container(file, tmp_path / "out")[0]:
        together = simulate_fmu(
            str(fmu), output_interval=1e-3, output=["wheel.w", "friction.torque", "friction.torque_sd"]
        )

        np.testing.assert_allclose(together["wheel.w"], apart["wheel.w"], rtol=1e-12)
        np.testing.assert_allclose(
            together["friction.torque"], apart["friction.torque"], rtol=1e-10
        )  # large weights cancel
        assert together["wheel.w"][-1] == pytest.approx(3.0 * np.exp(-0.4), rel=1e-3)


def test_block_that_learns_while_it_runs_is_refused_by_name(tmp_path: Path) -> None:
    file = written(tmp_path, "learn = { budget = 20, noise = 0.1 }")

    with pytest.raises(MisfitError, match="component 'friction': it learns while it runs, which an FMU does not"):
        build_container(file, tmp_path / "out")
