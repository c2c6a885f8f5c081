"""Extremes and sums of any part of a series are those that numpy finds in all of it."""

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from orchestrator.studio.views.chosen import Chosen
from orchestrator.studio.views.pyramid import Pyramid, base_level, pyramid
from orchestrator.studio.views.sums import Sums, block_moments

values = st.floats(-1e6, 1e6, width=32) | st.just(float("nan"))


@st.composite
def series_and_range(draw: st.DrawFn) -> tuple[np.ndarray, int, int]:
    """A series of up to some 3000 values, a few of them drawn, and a part of it."""
    drawn = np.array(draw(st.lists(values, min_size=1, max_size=30)), dtype=np.float32)
    series = np.resize(drawn, draw(st.integers(1, 3000)))
    start = draw(st.integers(0, len(series) - 1))
    return series, start, draw(st.integers(start + 1, len(series)))


def built(series: np.ndarray) -> Pyramid:
    return pyramid(series, base_level(series))


@settings(max_examples=150, deadline=None)
@given(series_and_range(), st.integers(1, 500))
def test_each_block_holds_the_extremes_of_its_samples(case: tuple[np.ndarray, int, int], most: int) -> None:
    series, start, stop = case
    blocks = built(series).blocks(start, stop, most)
    bounds = np.minimum(blocks.bounds, len(series))

    assert 1 <= len(blocks.low) <= max(most, 2)
    assert bounds[0] <= start < bounds[0] + blocks.size and stop <= bounds[-1] < stop + blocks.size
    for low, high, first, last in zip(blocks.low, blocks.high, bounds[:-1], bounds[1:], strict=True):
        finite = series[first:last][np.isfinite(series[first:last])]
        assert (low, high) == (finite.min(), finite.max()) if finite.size else np.isnan(low) and np.isnan(high)


@settings(max_examples=60, deadline=None)
@given(st.integers(1, 20_000), st.integers(2, 900), st.data())
def test_a_single_peak_is_seen_from_any_distance(samples: int, most: int, data: st.DataObject) -> None:
    series = np.zeros(samples, dtype=np.float32)
    series[data.draw(st.integers(0, samples - 1))] = 1.0

    assert built(series).blocks(0, samples, most).high.max() == 1.0
    assert built(series).span == ((0.0, 1.0) if samples > 1 else (1.0, 1.0))


@settings(max_examples=100, deadline=None)
@given(series_and_range())
def test_sums_of_a_part_are_those_of_numpy(case: tuple[np.ndarray, int, int]) -> None:
    series, start, stop = case
    part = series[start:stop].astype(float)
    part = part[np.isfinite(part)]
    found = Sums(series, block_moments(series)).between(start, stop)

    assert found.count == part.size
    np.testing.assert_allclose(found.total, part.sum(), rtol=1e-12, atol=1e-12 * np.abs(part).sum())
    np.testing.assert_allclose(found.square, np.sum(part**2), rtol=1e-12)


def test_a_peak_before_a_quiet_stretch_does_not_drown_its_error() -> None:
    series = np.full(1000, 1e-3, dtype=np.float32)
    series[3] = 1e9

    assert np.isclose(Sums(series, block_moments(series)).between(100, 900).rms, 1e-3, rtol=1e-6)


@settings(max_examples=150, deadline=None)
@given(st.lists(st.booleans(), min_size=1, max_size=400), st.integers(1, 60))
def test_intervals_and_mask_tell_the_same(flags: list[bool], size: int) -> None:
    mask = np.array(flags)
    chosen = Chosen.where(mask)
    series = np.arange(len(mask), dtype=np.float32)
    bounds = np.append(np.arange(0, len(mask), size), len(mask))

    assert np.array_equal(chosen.mask(len(mask)), mask)
    assert chosen.count == mask.sum()
    assert np.isclose(chosen.moments(Sums(series, block_moments(series))).total, series[mask].sum())
    expected = [mask[first:last].any() for first, last in zip(bounds[:-1], bounds[1:], strict=True)]
    assert chosen.touches(bounds).tolist() == expected


def test_every_entry_of_a_thinned_mask_stands_for_its_samples() -> None:
    chosen = Chosen.where(np.array([False, True, True, False, True]), stride=3, length=14)

    assert list(chosen) == [(3, 9), (12, 14)]
    assert list(chosen.within(5, 13)) == [(5, 9), (12, 13)]
