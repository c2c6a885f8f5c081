"""First phases of oscillations: as the trials show them, whatever a fit would begin with."""

import numpy as np
import pytest

from fmus.errors import ComponentError
from orchestrator.diagnosis.fit.canonical import Oscillation
from orchestrator.diagnosis.fit.phases import Error, with_phases

TIME, TURN = np.arange(200) * 0.01, 2 * np.pi * 3.0
AMPLITUDE, DRIFT = 0.04, 0.3
# The states are a speed, then sine and cosine of the phase; the parameters are the amplitude and the frequency.
PLACE = Oscillation((0,), (1, 2))


def trial_of(phase: float, guess: float) -> Error:
    """Error of a swing of `guess` in a trial that swings by AMPLITUDE at a phase, and drifts."""

    def error(start: np.ndarray) -> np.ndarray:
        modelled = guess * (start[1] * np.cos(TURN * TIME) + start[2] * np.sin(TURN * TIME)) / np.hypot(*start[1:])
        return np.asarray(modelled - AMPLITUDE * np.sin(TURN * TIME + phase) - DRIFT * TIME)

    return error


@pytest.mark.parametrize("guess", [0.05, 1e-3, -0.2])
def test_each_trial_begins_at_its_own_phase_with_the_amplitude_of_all(guess: float) -> None:
    phases = [0.3, 2.0, -2.9, -1.2]
    starts = [np.array([k, 0.0, 1.0]) for k in range(4)]
    drift = [TIME[:, None]] * 4

    first, begun = with_phases([PLACE], np.array([guess, 3.0]), starts, [trial_of(p, guess) for p in phases], drift)

    sign = np.sign(guess)
    np.testing.assert_allclose(first, [sign * AMPLITUDE, 3.0], rtol=1e-9)
    expected = [[k, sign * np.sin(p), sign * np.cos(p)] for k, p in enumerate(phases)]
    np.testing.assert_allclose(begun, expected, atol=1e-9)


def test_trial_that_cannot_be_run_keeps_its_start() -> None:
    def fails(start: np.ndarray) -> np.ndarray:
        raise ComponentError("left the finite numbers")

    starts = [np.array([0.0, 0.0, 1.0])] * 2
    errors, beside = [fails, trial_of(0.5, 0.1)], [TIME[:, None]] * 2

    first, begun = with_phases([PLACE], np.array([0.1, 3.0]), starts, errors, beside)

    np.testing.assert_array_equal(begun[0], starts[0])
    # The mean square over both trials
    assert first[0] == pytest.approx(AMPLITUDE / np.sqrt(2))
