"""The same behaviour, recorded with other steps, is no change; another behaviour is one, whatever the steps."""

import numpy as np
import pytest

from orchestrator.regress.comparison import Signal, Tolerance, compare_signals

STEP, END = 0.01, 4.0


def curve(time: np.ndarray, late: float = 0.0) -> np.ndarray:
    """A decay, a kink at 1.003 s, a small jump at 2 s and a large one at 3.004 s."""
    values = np.exp(-8.0 * time) + 0.4 * np.maximum(0.0, time - 1.003 - late)
    return values + 0.03 * (time >= 2.0 + late) + 0.8 * (time >= 3.004 + late)


def recorded(step: float, late: float = 0.0, offset: float = 0.0, gain: float = 1.0) -> Signal:
    time = np.arange(round(END / step) + 1) * step
    return Signal("x", time, gain * curve(time, late) + offset, "m")


REFERENCE = recorded(STEP)
STEPS = [STEP / 5, STEP / 2, STEP / 3, STEP, 2 * STEP, 4 * STEP]


@pytest.mark.parametrize("step", STEPS)
def test_the_same_curve_recorded_with_another_step_passes(step: float) -> None:
    verdict = compare_signals(recorded(step), REFERENCE, Tolerance())

    assert verdict.passed, verdict.reason


@pytest.mark.parametrize("step", STEPS)
@pytest.mark.parametrize("change", [{"offset": 0.01}, {"gain": 1.01}, {"late": 0.03}], ids=str)
def test_another_curve_fails_whatever_the_step(step: float, change: dict[str, float]) -> None:
    assert not compare_signals(recorded(step, **change), REFERENCE, Tolerance()).passed


def test_uneven_stamps_of_the_same_curve_pass() -> None:
    inner = np.random.default_rng(4).uniform(0.0, END, 700)
    time = np.concatenate([[0.0], np.sort(inner), [END]])

    assert compare_signals(Signal("x", time, curve(time), "m"), REFERENCE, Tolerance()).passed
    assert not compare_signals(Signal("x", time, curve(time) + 0.01, "m"), REFERENCE, Tolerance()).passed
