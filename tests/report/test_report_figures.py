"""What the figures compute before they draw."""

import subprocess
import sys

import numpy as np
import pytest
from builders import FLOOR, comparison

from orchestrator.compare.result import TrialCurves
from orchestrator.report.figures import shown_signals, shown_trials
from orchestrator.report.figures._residuals import binned, spectrum


def test_white_noise_lies_flat_at_its_standard_deviation_times_the_root_of_two_steps() -> None:
    random = np.random.default_rng(1)
    step, noise = 0.004, 0.003
    trials = []
    for _ in range(20):
        measured = {"q": noise * random.standard_normal(2500)}
        trials.append(TrialCurves("a", "learning", np.arange(2500) * step, measured, {"q": np.zeros(2500)}))

    frequency, density = spectrum(trials, "q", bins=10)

    # The lowest bins average few lines; above 5 Hz each holds hundreds.
    assert density[frequency > 5] == pytest.approx(noise * np.sqrt(2 * step), rel=0.1)


def test_a_sine_peaks_at_its_frequency() -> None:
    time = np.arange(2500) * 0.004
    trial = TrialCurves("a", "learning", time, {"q": np.sin(2 * np.pi * 7.0 * time)}, {"q": np.zeros(2500)})

    frequency, density = spectrum([trial], "q")

    assert frequency[np.argmax(density)] == pytest.approx(7.0, rel=0.05)


def test_bins_of_a_straight_line_lie_on_it() -> None:
    against = np.random.default_rng(2).uniform(-1, 1, 5000)

    centre, mean, spread = binned(against, 3 * against + 1)

    assert mean == pytest.approx(3 * centre + 1)
    assert np.all(spread < 0.15)


def test_bins_of_a_constant_are_one() -> None:
    centre, mean, _ = binned(np.full(10, 2.0), np.arange(10.0))

    assert (centre.tolist(), mean.tolist()) == ([2.0], [4.5])


def test_at_most_four_trials_are_shown_the_last_a_learning_one() -> None:
    shown = shown_trials(comparison(n=50, n_learning=3, n_held_out=5))

    assert [trial.set for trial in shown] == ["held_out"] * 3 + ["learning"]


def test_the_three_worst_of_many_signals_are_shown_in_their_order() -> None:
    found = comparison(n=50, signals=tuple("abcde"))
    assert found.held_out is not None
    found.held_out.rmse.update(dict(zip("abcde", (5 * FLOOR, FLOOR, 3 * FLOOR, 9 * FLOOR, 2 * FLOOR), strict=True)))  # type: ignore[attr-defined]

    assert shown_signals(found) == ["a", "c", "d"]


def test_importing_the_report_does_not_import_what_is_slow() -> None:
    code = "import sys, orchestrator.report.html, orchestrator.report.tables; print(sorted(sys.modules))"
    modules = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout

    assert "'matplotlib'" not in modules
    assert "'jinja2'" not in modules
