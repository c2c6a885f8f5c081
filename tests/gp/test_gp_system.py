"""A block named in a system file, coupled to a wheel whose friction it has learned: decay as the formula says."""

from pathlib import Path

import numpy as np
import pytest

from fmus.errors import MisfitError
from orchestrator.cosim.load import load_system
from orchestrator.cosim.run import simulate

DAMPING, INERTIA, FIRST, STOP = 0.4, 0.5, 3.0, 1.0
SYSTEM = f"""
[run]
stop = {STOP}
step = 0.001
master = "iterative"

[components.wheel]                 # dw/dt = torque / inertia
kind = "controller"
a = [[0.0]]
b = [[{1 / INERTIA}]]
c = [[1.0]]
d = [[0.0]]
inputs = {{ torque = "N.m" }}
outputs = {{ w = "rad/s" }}
parameters = {{ x0 = [{FIRST}] }}

[components.friction]
gp = "bench.csv"
inputs = ["speed"]
outputs = ["torque"]
kernel = "squared_exponential"
noise = 1e-4
OPTIONS

[[connections]]
from = "wheel.w"
to = "friction.speed"
[[connections]]
from = "friction.torque"
to = "wheel.torque"
"""


@pytest.fixture
def bench(tmp_path: Path) -> Path:
    """Torques of a friction bench, in mN.m."""
    speed = np.linspace(-4.0, 4.0, 41)
    rows = [f"{0.1 * k:.9g},{w:.9g},{-1e3 * DAMPING * w:.9g}" for k, w in enumerate(speed)]
    (tmp_path / "bench.csv").write_text("\n".join(["time,speed,torque", *rows]) + "\n")
    (tmp_path / "case.toml").write_text(
        'files = ["bench.csv"]\nlearning = [1]\n[columns]\ntime = "s"\nspeed = "rad/s"\ntorque = "mN.m"\n'
    )
    return tmp_path


def written(folder: Path, options: str = "") -> Path:
    (folder / "system.toml").write_text(SYSTEM.replace('"bench.csv"', '"case.toml"').replace("OPTIONS", options))
    return folder / "system.toml"


def test_a_wheel_slows_down_by_the_friction_that_the_block_learned(bench):
    found = simulate(load_system(written(bench)), stop=STOP)
    exact = FIRST * np.exp(-DAMPING / INERTIA * found.time)
    # 1e-4 mN.m of noise on torques of 1600: what is left is the coupling, of second order in a step of 1 ms.
    assert np.abs(found["wheel.w"] - exact).max() < 1e-5


def test_an_unknown_key_of_a_block_is_told_with_the_component(bench):
    with pytest.raises(MisfitError, match="component 'friction': unknown key 'budget'"):
        simulate(load_system(written(bench, "budget = 3")), stop=STOP)
