"""The examples of control with a learned block do what they say."""

import runpy
from pathlib import Path
from typing import Any

import numpy as np
import pytest

EXAMPLES = Path(__file__).parents[2] / "docs" / "examples"


@pytest.fixture
def mpc() -> dict[str, Any]:
    return runpy.run_path(str(EXAMPLES / "gp_mpc.py"))


def test_an_mpc_with_the_learned_residual_comes_near_the_wall_and_never_touches_it(mpc):
    alone, learned = mpc["run"](None), mpc["run"](mpc["learned"]())
    assert alone.max() > mpc["WALL"] + 0.02  # the force that it does not know pulls it in
    assert learned.max() <= mpc["WALL"]
    assert mpc["WALL"] - learned[-1] < 0.05


def test_integral_action_takes_away_what_the_learned_torque_does_not_know():
    example = runpy.run_path(str(EXAMPLES / "gp_integral_action.py"))
    plain, forward, whole = (example["run"](*way) for way in ((False, 0.0), (True, 0.0), (True, example["INTEGRAL"])))
    # At rest PROPORTIONAL * error + LOAD = 0 where the spring is fed forward.
    assert forward[-1] == pytest.approx(-example["LOAD"] / example["PROPORTIONAL"], abs=0.01)
    assert abs(plain[-1]) > 2.0 * abs(forward[-1])
    assert np.abs(whole[-100:]).max() < 0.002
