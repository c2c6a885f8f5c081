"""The noise floor: what sensors and measured inputs leave when start values are fitted."""

from typing import Any, cast

import numpy as np
import pytest

from orchestrator.compare.comparison import noise_floor
from orchestrator.measurements import BoundSet, BoundTrial
from orchestrator.models.contract import FittedTrial, Model

STEP, COUNT, FORCE_NOISE, POSITION_NOISE = 0.01, 400, 0.3, 1e-4


class FreeMass:
    """A mass of 1 kg that a force moves; the output is its position in m."""

    def simulate(self, time: np.ndarray, inputs: np.ndarray, names: Any, start: dict[str, float]) -> np.ndarray:
        speed = start["v"] + STEP * np.r_[0.0, np.cumsum(inputs[:-1, 0])]
        position = start["x"] + STEP * np.r_[0.0, np.cumsum(speed[:-1])]
        return position[:, None]


def floor(force_noise: float) -> float:
    time = np.arange(COUNT) * STEP
    force, start = np.sin(time)[:, None], {"x": 0.1, "v": -0.2}
    outputs = FreeMass().simulate(time, force, ("x",), start)
    trial = BoundTrial("a", "learning", time, force, outputs)
    noise = {"f": force_noise, "x": POSITION_NOISE}
    data = BoundSet((trial,), ("f",), ("x",), (), (), noise, ())
    followed = [(trial, FittedTrial(outputs, start))] * 20
    return noise_floor(cast(Model, FreeMass()), data, followed)["x"]


def test_exact_inputs_leave_the_noise_of_the_sensor() -> None:
    assert floor(0.0) == pytest.approx(POSITION_NOISE)


def test_of_noise_that_is_integrated_twice_a_fitted_line_is_taken_away() -> None:
    """Second computation: the covariance of twice summed white noise, with the space of 1 and t projected out."""
    once = STEP * np.tril(np.ones((COUNT, COUNT)), -1)
    twice = once @ once
    line = np.linalg.qr(np.column_stack([np.ones(COUNT), np.arange(COUNT)]))[0]
    left = twice - line @ (line.T @ twice)
    carried = FORCE_NOISE * np.sqrt(np.sum(left**2) / COUNT)

    assert np.sqrt(np.sum(twice**2) / COUNT) * FORCE_NOISE > 5 * carried  # what the floor would be without a fit
    assert floor(FORCE_NOISE) == pytest.approx(np.hypot(carried, POSITION_NOISE), rel=0.15)
