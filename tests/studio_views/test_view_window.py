"""What goes to the browser is bounded, holds every peak in sight, and nothing that is out of sight."""

import json

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from view_builders import STEP, comparison, trial

from orchestrator.compare.result import TrialCurves
from orchestrator.studio.views.chosen import Chosen
from orchestrator.studio.views.selection import Range
from orchestrator.studio.views.store import in_memory
from orchestrator.studio.views.window import MOST_POINTS, curve_window, packed


def test_bytes_to_the_browser_do_not_grow_with_the_length_of_trials() -> None:
    sizes = []
    for samples in (20_000, 200_000):
        data = in_memory(comparison([trial(0, samples), trial(1, samples)]))
        sizes.append(len(packed(curve_window(data, "q1", (0, 1), data.time, 1000))))

    assert max(sizes) < 2 * 1000 * 2 * 17 + 1000  # trials, columns, extremes, bytes a point
    assert max(sizes) < 2.1 * min(sizes)


def test_points_do_not_grow_with_the_number_of_trials() -> None:
    data = in_memory(comparison([trial(k, 5000) for k in range(30)]))

    assert curve_window(data, "q1", tuple(range(30)), data.time, 1500).points <= MOST_POINTS


@settings(max_examples=60, deadline=None)
@given(st.data(), st.integers(50, 1200))
def test_extremes_in_sight_survive(data: st.DataObject, columns: int) -> None:
    samples = data.draw(st.integers(2, 9000))
    random = np.random.default_rng(data.draw(st.integers(0, 99)))
    # Steps between samples vary a hundredfold.
    time = np.cumsum(STEP * 10 ** random.uniform(-1, 1, samples))
    measured = random.standard_normal(samples)
    views = in_memory(comparison([_curves(time, measured)]))
    low, high = sorted(data.draw(st.tuples(*[st.floats(float(time[0]), float(time[-1]))] * 2)))
    seen = (time >= low) & (time <= high)
    window = curve_window(views, "q1", (0,), Range(low, high), columns)
    points = window.trials[0]

    assert np.all(np.diff(points.time) >= 0)
    if seen.any():
        expected = measured[seen].astype(np.float32)
        assert points.measured.min() <= expected.min() and points.measured.max() >= expected.max()
        assert window.values.low <= expected.min() and window.values.high >= expected.max()


@pytest.mark.parametrize(("low", "high"), [(10.0, 60.0), (50.0, 50.3), (0.0, 99.99)])
def test_points_are_within_sight_but_for_a_block_at_either_end(low: float, high: float) -> None:
    views = in_memory(comparison([trial(0, 10_000)]))
    points = curve_window(views, "q1", (0,), Range(low, high), 500).trials[0]
    block = STEP * max(1, 2 ** np.ceil(np.log2((high - low) / STEP / 500)))

    assert points.time.min() >= -2 * block
    assert points.time.max() <= high - low + 2 * block


def test_few_samples_go_as_they_are() -> None:
    curves = trial(0, 10_000)
    points = curve_window(in_memory(comparison([curves])), "q1", (0,), Range(20.0, 21.0), 500).trials[0]
    # One more sample at either end leads the line to the edge.
    expected = slice(1999, 2102)

    np.testing.assert_allclose(points.time + 20.0, curves.time[expected])
    np.testing.assert_array_equal(points.measured, curves.measured["q1"][expected].astype(np.float32))
    np.testing.assert_allclose(points.residual, (curves.measured["q1"] - curves.modelled["q1"])[expected], rtol=1e-6)


def test_the_browser_reads_back_what_was_packed() -> None:
    views = in_memory(comparison([trial(0, 1003), trial(1, 507)]))
    window = curve_window(views, "q2", (0, 1), views.time, 300, {1: Chosen.between(100, 200)})
    content = packed(window)
    length = int.from_bytes(content[:4], "little")
    head, at = json.loads(content[4 : 4 + length]), 4 + length

    assert (4 + length) % 4 == 0
    for entry, points in zip(head["trials"], window.trials, strict=True):
        count = entry["count"]
        numbers = np.frombuffer(content, "<f4", 4 * count, at).reshape(4, count)
        np.testing.assert_array_equal(numbers[1], points.measured)
        np.testing.assert_array_equal(numbers[3], points.residual)
        flags = np.frombuffer(content, "u1", count, at + 16 * count)
        np.testing.assert_array_equal(flags, points.chosen)
        at += 16 * count + -(-count // 4) * 4
    assert at == len(content)
    assert not window.trials[0].chosen.any() and window.trials[1].chosen.any()


def test_a_run_that_diverged_leaves_a_gap_and_finite_limits() -> None:
    time = STEP * np.arange(100)
    measured = np.where(time > 0.5, np.inf, 1.0)
    window = curve_window(in_memory(comparison([_curves(time, measured)])), "q1", (0,), Range(0.0, 1.0), 200)

    assert np.isnan(window.trials[0].measured[60])
    assert (window.values.low, window.values.high) == (0.0, 1.0)


def _curves(time: np.ndarray, measured: np.ndarray) -> TrialCurves:
    still = np.zeros(len(time))
    return TrialCurves("a.csv", "learning", time, {"q1": measured, "q2": still}, {"q1": still, "q2": still}, {})
